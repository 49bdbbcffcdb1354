"""Fair comparison of controllers, beside the paper's numbers."""
