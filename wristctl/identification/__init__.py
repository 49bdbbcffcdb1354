"""Parameters of a real wrist, found from what its motors did and its camera saw."""
