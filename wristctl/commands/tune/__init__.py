"""`tune`: gains by search."""
