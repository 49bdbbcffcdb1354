"""Does a loop come to rest, or does it swing or hunt: what is left where the reference rests, and how fast it moves.

Half the peak-to-peak of the angle over the last second, its trend removed. Of a reference that never rests it is the
error's, over the last second or the last two of its periods, with all up to four times its frequency removed.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.trajectory import Trajectory

LIMIT_CYCLE = np.deg2rad(0.1)
"""Half peak-to-peak [rad] above which a loop is said to swing."""
WINDOW = 1.0
"""[s]"""
LONG_HOLD = 20.0
"""Rest [s] that shows whether a loop hunts."""
_HARMONICS = 4.0
_STILL = 1e-9
"""[rad] below which there is nothing but rounding."""
_UNKNOWN = math.nan


def oscillation(course: Trajectory) -> float:
    """Half the peak-to-peak [rad] that is left at rest; nan where the wrist has failed or there is no time to rest."""
    left = remaining(course)
    return _UNKNOWN if left is None else float(np.ptp(left) / 2.0)


def hunting(course: Trajectory) -> float:
    """Half the peak-to-peak [rad] over the last half of a hold of at least LONG_HOLD; nan where there is none.

    Friction and slow integrals creep with periods of 5 to 20 s, which one second cannot show.
    """
    moved = np.flatnonzero(np.diff(course.theta_ref))
    begun = int(moved[-1]) + 1 if len(moved) else 0
    held = course.theta[(begun + len(course.theta)) // 2 :]
    if (len(course.theta) - begun) * _step(course) < LONG_HOLD or not np.isfinite(held).all():
        return _UNKNOWN
    place = np.linspace(-1.0, 1.0, len(held))
    trend = np.polynomial.polynomial.polyfit(place, held, 1)
    return float(np.ptp(held - np.polynomial.polynomial.polyval(place, trend)) / 2.0)


def oscillation_frequency(course: Trajectory) -> float:
    """Of what is left the strongest frequency [1/s]; nan where there is nothing."""
    left = remaining(course)
    return _UNKNOWN if left is None or np.ptp(left) < _STILL else _strongest(left, _step(course))


def remaining(course: Trajectory) -> Array | None:
    """What is left at the end of a course, its trend or what follows its reference removed, (W,) [rad]."""
    step, samples = _step(course), len(course.time)
    window = round(WINDOW / step)
    if window > samples or not np.isfinite(course.theta[-window:]).all():
        return None
    if np.ptp(course.theta_ref[-window:]) == 0.0:
        return _without_trend(course.theta[-window:])
    frequency = _strongest(course.theta_ref - course.theta_ref.mean(), step)
    window = min(samples, max(window, round(2.0 / (frequency * step))))
    error = (course.theta - course.theta_ref)[-window:]
    if not np.isfinite(error).all():
        return None
    degree = 4 + round(
        math.pi * _HARMONICS * frequency * step * window
    )  # a polynomial follows so many waves, and no more
    basis = _polynomials(window, min(degree, window // 2))
    left: Array = error - basis @ (basis.T @ error)
    return left


@lru_cache(8)
def _polynomials(samples: int, degree: int) -> Array:
    """An orthonormal basis of the polynomials up to a degree, (samples, degree + 1)."""
    basis: Array = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, samples), degree))[0]
    return basis


def _without_trend(angle: Array) -> Array:
    """The angle less its mean and slope, told apart from those of a swing that is cut in its middle."""
    place = np.linspace(-1.0, 1.0, len(angle))
    trend = np.stack([np.ones_like(place), place], axis=1)
    left = angle - trend @ np.linalg.lstsq(trend, angle, rcond=None)[0]
    if np.ptp(left) < _STILL:
        return np.asarray(left)
    phase = math.pi * _strongest(left, 1.0) * len(angle) * place
    both = np.concatenate([trend, np.stack([np.cos(phase), np.sin(phase)], axis=1)], axis=1)
    return np.asarray(angle - trend @ np.linalg.lstsq(both, angle, rcond=None)[0][:2])


def _strongest(values: Array, step: float) -> float:
    """The strongest frequency [1/s] of values `step` [s] apart."""
    count = 8 * len(values)
    power = np.abs(np.fft.rfft(values * np.hanning(len(values)), count))
    return float(np.argmax(power[8:]) + 8) / (count * step)


def _step(course: Trajectory) -> float:
    return float(course.time[1] - course.time[0]) if len(course.time) > 1 else WINDOW
