"""The smooth move of a hand."""

from __future__ import annotations

import numpy as np

from wristctl.arrays import Array


def minimum_jerk(time: Array, duration: float) -> Array:
    """The minimum-jerk course from 0 to 1 and two derivatives, (3, T), by the time (T,) since it began.

    From Flash and Hogan, J. Neurosci. 5 (1985) 1688.
    """
    found = np.zeros((3, len(time)))
    found[0] = time >= duration
    moving = np.flatnonzero((time > 0.0) & (time < duration))
    s = time[moving] / duration
    found[0, moving] = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    found[1, moving] = 30.0 * s**2 * (1.0 - s) ** 2 / duration
    found[2, moving] = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2
    return found
