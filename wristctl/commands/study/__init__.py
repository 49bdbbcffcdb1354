"""`study`: every law tuned and judged at equal budget."""
