"""`hw-run`: the paper's experiment on the whole chain, from marker to motor."""
