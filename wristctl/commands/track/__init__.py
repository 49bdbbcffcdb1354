"""`track`: the wrist's angle in a recorded video."""
