"""The course of a move between two answers of the board: far too few come through a slow link to join them by lines.

Lines between positions 16 ms apart cut the corners of a move that takes 80 ms, and a fit takes that for 2 to 6 ms of a
camera's age. How the board ramps is known; only when it began is found, by the answers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from wristctl.arrays import Array

_BRAKING = 0.9
"""Of its acceleration the board plans to brake with (motion.c)."""
_EARLY, _LATE = 0.1, 0.05
"""Seconds before and after the first answer between which it is looked for when a move began."""


class RampedMove(NamedTuple):
    """From rest to rest, `distance` steps away, either sign; rates in steps/s, acceleration in steps/s^2."""

    distance: float
    rate: float
    acceleration: float

    def course(self, time: Array) -> Array:
        """Steps made (n,), so many seconds (n,) after it began."""
        far, speeding, braking = abs(self.distance), self.acceleration, _BRAKING * self.acceleration
        top = min(self.rate, math.sqrt(2.0 * far * speeding * braking / (speeding + braking)))
        up, down = top / speeding, top / braking
        level = (far - 0.5 * top * (up + down)) / top
        left = up + level + down - time
        going = 0.5 * speeding * np.clip(time, 0.0, up) ** 2 + top * np.clip(time - up, 0.0, level)
        made = np.where(time < up + level, going, far - 0.5 * braking * np.clip(left, 0.0, down) ** 2)
        return np.asarray(math.copysign(1.0, self.distance) * made)

    def began(self, time: Array, made: Array) -> float:
        """When it began [s], by the steps made (n,) at times (n,) [s], the first of them where it was asked for."""

        def misfit(begin: float) -> float:
            return float(np.sum((self.course(time - begin) - made) ** 2))

        bounds = float(time[0]) - _EARLY, float(time[0]) + _LATE
        return float(minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-5}).x)
