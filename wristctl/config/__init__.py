"""Configuration of a study: typed sections, strict YAML, overrides. Knows no physics and no files of results."""
