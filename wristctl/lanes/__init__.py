"""Numbers that are a block of rollouts wide, and the compiler settings for code that computes with them."""
