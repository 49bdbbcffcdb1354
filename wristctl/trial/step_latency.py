"""How old a camera's pictures are, by strokes of a motor that they show.

The wrist follows a spool as a mass on springs does, theta'' + 2 zeta w theta' + w^2 theta = w^2 g p, and some of it
slowly: friction gives way, and the bend across the plane comes after. The camera shows it late. Delay, w, zeta and the
share of the slow part are fitted together to strokes whose beginning falls between pictures at random: what the wrist
itself lags behind is then not taken for the camera's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.signal import bilinear, lfilter

from wristctl.arrays import Array

_STEP = 1e-3
"""Seconds between two samples of the model's course."""
_SLOW = 0.15
"""Time constant [s] of the slow part. Without one an age comes out 2 to 3 ms too large on the emulated rig, 5 where
sheaths rub, and off by 6 to 8 where one plane is half as stiff as the other; half or twice as long a time changes 1."""
_LATEST = 0.5
"""Delay [s] beyond which nothing is looked for."""
_DELAYS, _RATES, _DAMPING = np.arange(0.0, 0.4, 0.02).tolist(), (15.0, 30.0, 60.0, 120.0), 0.5
"""Delays [s] and natural frequencies [rad/s] of which the best begins the fit."""


class MotorStroke(NamedTuple):
    """One stroke of the motor: positions (n,) [steps] at times (n,) [s], and angles (m,) [rad] stamped (m,) [s]."""

    time: Array
    position: Array
    stamped: Array
    angle: Array


class Latency(NamedTuple):
    """What strokes tell."""

    delay: float
    """From the middle of an exposure to its time stamp [s]."""
    sd: float
    """Standard deviation of that [s], by the fit's residuals."""
    rate: float
    """The wrist's natural frequency on this tendon [rad/s]."""
    scatter: float
    """Of the angles about the fit [rad], a standard deviation."""
    pictures: int


def find_latency(strokes: Sequence[MotorStroke]) -> Latency:
    """The delay by which strokes were seen. ValueError for fewer than twenty pictures."""
    count = sum(len(each.angle) for each in strokes)
    if count < 20:
        raise ValueError(f"{count} pictures are too few")

    def fitted(begin: Array, parts: int) -> OptimizeResult:
        def errors(x: Array) -> Array:
            return _errors(strokes, _courses(strokes, float(np.exp(x[1])), float(np.exp(x[2]))), float(x[0]), parts)

        bounds = [-0.05, np.log(3.0), np.log(0.02)], [_LATEST, np.log(1000.0), np.log(20.0)]
        return least_squares(errors, begin, bounds=bounds, x_scale=[1e-3, 0.1, 0.1])

    tried = []
    for rate in _RATES:
        courses = _courses(strokes, rate, _DAMPING)
        tried += [(float(np.sum(_errors(strokes, courses, delay, 1) ** 2)), delay, rate) for delay in _DELAYS]
    _, begin, rate = min(tried)
    swing = fitted(np.array([begin, np.log(rate), np.log(_DAMPING)]), 1)  # alone, lest it be taken for the slow part
    found = fitted(swing.x, 2)
    free = max(1, count - len(strokes) - 5)
    variance = 2.0 * float(found.cost) / free
    slope = np.asarray(found.jac, np.float64)
    covariance = variance * np.linalg.pinv(slope.T @ slope)
    delay, rate = float(found.x[0]), float(np.exp(found.x[1]))
    return Latency(delay, float(np.sqrt(covariance[0, 0])), rate, float(np.sqrt(variance)), count)


class _Course(NamedTuple):
    """How the model answers a stroke, from rest: at times (n,) [s], and so much of it slowly, (n,) each."""

    time: Array
    parts: tuple[Array, Array]


def _errors(strokes: Sequence[MotorStroke], courses: Sequence[_Course], delay: float, parts: int) -> Array:
    """Angles less the model's first parts; each stroke has its own angle to begin from, all have one gain of each."""
    seen, shown = [], []
    for each, course in zip(strokes, courses, strict=True):
        model = np.array([np.interp(each.stamped - delay, course.time, part) for part in course.parts[:parts]]).T
        seen.append(each.angle - each.angle.mean())
        shown.append(model - model.mean(axis=0))
    angle, model = np.concatenate(seen), np.concatenate(shown)
    gains: Array = np.linalg.lstsq(model, angle, rcond=1e-9)[0]
    return angle - model @ gains


def _courses(strokes: Sequence[MotorStroke], rate: float, damping: float) -> list[_Course]:
    swing = bilinear([rate**2], [1.0, 2.0 * damping * rate, rate**2], 1.0 / _STEP)
    slow = bilinear([1.0], [_SLOW, 1.0], 1.0 / _STEP)
    made = []
    for each in strokes:
        time = np.arange(each.time[0], each.time[-1], _STEP)
        answer = lfilter(*swing, np.interp(time, each.time, each.position) - each.position[0])
        made.append(_Course(time, (answer, lfilter(*slow, answer))))
    return made
