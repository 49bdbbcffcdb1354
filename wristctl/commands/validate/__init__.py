"""`validate`: the model held against recordings of a real robot."""
