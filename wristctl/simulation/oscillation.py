"""Does a loop come to rest, or does it swing: the oscillation that is left where the reference rests, and how fast.

Half the peak-to-peak of the angle over the last second, its trend removed. Of a reference that never rests it is the
error's, over the last second or the last two of its periods, with all up to four times its frequency removed.
"""

from __future__ import annotations

import math

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.trajectory import Trajectory

LIMIT_CYCLE = np.deg2rad(0.1)
"""Half peak-to-peak [rad] above which a loop is said to swing."""
WINDOW = 1.0
"""[s]"""
_HARMONICS = 4
_UNKNOWN = math.nan


def oscillation(course: Trajectory) -> float:
    """Half the peak-to-peak [rad] that is left at rest; nan where the wrist has failed or there is no time to rest."""
    left = remaining(course)
    return _UNKNOWN if left is None else float(np.ptp(left) / 2.0)


def oscillation_frequency(course: Trajectory) -> float:
    """Of what is left the strongest frequency [1/s], to one over the window; nan where there is nothing."""
    left = remaining(course)
    if left is None or np.ptp(left) == 0.0:
        return _UNKNOWN
    power = np.abs(np.fft.rfft(left * np.hanning(len(left))))
    return float(np.argmax(power[1:]) + 1) / (len(left) * _step(course))


def remaining(course: Trajectory) -> Array | None:
    """What is left at the end of a course, its trend or its reference's harmonics removed, (W,) [rad]."""
    step, samples = _step(course), len(course.time)
    window = round(WINDOW / step)
    if window > samples or not np.isfinite(course.theta[-window:]).all():
        return None
    if np.ptp(course.theta_ref[-window:]) == 0.0:
        return _without(course.theta[-window:], np.stack([np.ones(window), np.arange(window)], axis=1))
    frequency = _frequency(course.theta_ref, step)
    window = min(samples, max(window, round(2.0 / (frequency * step))))
    phase = 2.0 * np.pi * frequency * step * np.arange(window)
    waves = [wave(k * phase) for k in range(1, _HARMONICS + 1) for wave in (np.cos, np.sin)]
    error = (course.theta - course.theta_ref)[-window:]
    if not np.isfinite(error).all():
        return None
    return _without(error, np.stack([np.ones(window), np.arange(window), *waves], axis=1))


def _without(values: Array, known: Array) -> Array:
    """What least squares leaves of values (W,) by known courses (W, k)."""
    scaled = known / np.abs(known).max(axis=0)
    left: Array = values - scaled @ np.linalg.lstsq(scaled, values, rcond=None)[0]
    return left


def _frequency(reference: Array, step: float) -> float:
    """The strongest frequency of a reference [1/s]."""
    power = np.abs(np.fft.rfft(reference - reference.mean(), 8 * len(reference)))
    return float(np.argmax(power[1:]) + 1) / (8 * len(reference) * step)


def _step(course: Trajectory) -> float:
    return float(course.time[1] - course.time[0]) if len(course.time) > 1 else WINDOW
