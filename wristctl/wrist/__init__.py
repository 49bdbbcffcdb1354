"""The wrist: constant-curvature segments with a hand at their end, pulled by tendons, bending in one plane."""
