"""The wrist in two planes: segments that bend toward any side, with any number of tendons."""
