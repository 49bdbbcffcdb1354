"""Numbers that are eight rollouts wide, and the compiler settings for code that computes with them."""
