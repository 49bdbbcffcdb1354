"""What a study consists of: typed sections, strict YAML, overrides. Knows no physics and no files of results."""
