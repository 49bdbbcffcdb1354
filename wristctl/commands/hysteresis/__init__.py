"""`hysteresis`: loops of a wrist whose tendons have friction."""
