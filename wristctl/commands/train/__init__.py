"""`train`: networks from tip position to bend."""
