"""`gen-data`: samples of tip positions and bending angles."""
