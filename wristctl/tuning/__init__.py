"""Search for gains: optimisers with one ask/tell face, and the objective."""
