"""Study files: strict YAML, overrides, sweeps, errors with their place, and the study written out in full."""
