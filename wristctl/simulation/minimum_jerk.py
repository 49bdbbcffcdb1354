"""The smooth move of a hand."""

import numpy as np

from wristctl.arrays import Array


def minimum_jerk(time: Array, duration: float) -> Array:
    """The minimum-jerk course from 0 to 1 and two derivatives, (3, T), by the time (T,) since it began, ascending.

    From Flash and Hogan, J. Neurosci. 5 (1985) 1688.
    """
    found = np.zeros((3, len(time)))
    first, last = np.searchsorted(time, 0.0, "right"), np.searchsorted(time, duration, "left")
    found[0, last:] = 1.0
    smooth_stroke(time[first:last] / duration, duration, found[:, first:last])
    return found


def smooth_stroke(s: Array, duration: float, out: Array) -> None:
    """The same within the move, into `out` (3, T), by the share s (T,) of the duration that has passed."""
    square, rest = s**2, 1.0 - s
    np.multiply(s**3, 10.0 - 15.0 * s + 6.0 * square, out=out[0])
    np.divide(30.0 * square * rest**2, duration, out=out[1])
    np.divide(60.0 * s * rest * (1.0 - 2.0 * s), duration**2, out=out[2])
