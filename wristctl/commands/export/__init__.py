"""`runs export` and `export-model`: runs and wrists for other programs."""
