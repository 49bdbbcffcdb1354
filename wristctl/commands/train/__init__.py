"""`train`: networks from tip position to bending angle."""
