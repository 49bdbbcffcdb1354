"""Figures, the wrist's drawing and animation, and the page of a run: what several commands share."""
