"""From tip positions to bending angles: data, the exact inverse, and networks that learn it."""
