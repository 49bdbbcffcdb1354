"""`identify`: the wrist's parameters from logged trials."""
