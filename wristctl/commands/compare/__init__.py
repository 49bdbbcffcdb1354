"""`compare`: controllers under the same conditions, beside the paper's numbers."""
