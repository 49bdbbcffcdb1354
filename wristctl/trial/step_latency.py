"""How old a camera's pictures are, by strokes of a motor that they show.

The wrist follows a spool as a mass on springs does, theta'' + 2 zeta w theta' + w^2 theta = w^2 g p, and the camera
shows it late. Delay, w and zeta are fitted together to strokes whose beginning falls between pictures at random: what
the wrist itself lags behind is then not taken for the camera's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import bilinear, lfilter

from wristctl.arrays import Array

_STEP = 1e-3
"""Seconds between two samples of the model's course."""
_LATEST = 0.5
"""Delay [s] beyond which nothing is looked for."""
_TRIED = [(delay, rate) for delay in np.arange(0.0, 0.4, 0.02) for rate in (15.0, 30.0, 60.0, 120.0)]
"""Delays [s] and natural frequencies [rad/s] of which the best begins the fit."""


class Stroke(NamedTuple):
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


def find_latency(strokes: Sequence[Stroke]) -> Latency:
    """The delay by which strokes were seen. ValueError for fewer than twenty pictures."""
    count = sum(len(each.angle) for each in strokes)
    if count < 20:
        raise ValueError(f"{count} pictures are too few")

    def errors(x: Array) -> Array:
        return _errors(strokes, float(x[0]), float(np.exp(x[1])), float(np.exp(x[2])))

    starts = [np.array([delay, np.log(rate), np.log(0.5)]) for delay, rate in _TRIED]
    best = min(starts, key=lambda x: float(np.sum(errors(x) ** 2)))
    bounds = [-0.05, np.log(3.0), np.log(0.02)], [_LATEST, np.log(1000.0), np.log(20.0)]
    fitted = least_squares(errors, best, bounds=bounds, x_scale=[1e-3, 0.1, 0.1])
    free = max(1, count - len(strokes) - 4)
    variance = 2.0 * float(fitted.cost) / free
    slope = np.asarray(fitted.jac, np.float64)
    covariance = variance * np.linalg.pinv(slope.T @ slope)
    delay, rate = float(fitted.x[0]), float(np.exp(fitted.x[1]))
    return Latency(delay, float(np.sqrt(covariance[0, 0])), rate, float(np.sqrt(variance)), count)


def _errors(strokes: Sequence[Stroke], delay: float, rate: float, damping: float) -> Array:
    """Angles less the model's; each stroke has its own angle to begin from, all have one gain."""
    seen, shown = [], []
    for each in strokes:
        model = _course(each, rate, damping, each.stamped - delay)
        seen.append(each.angle - each.angle.mean())
        shown.append(model - model.mean())
    angle, model = np.concatenate(seen), np.concatenate(shown)
    gain = float(angle @ model) / max(float(model @ model), 1e-12)
    return angle - gain * model


def _course(stroke: Stroke, rate: float, damping: float, at: Array) -> Array:
    """The model's answer to a stroke, from rest."""
    time = np.arange(stroke.time[0], stroke.time[-1], _STEP)
    driven = np.interp(time, stroke.time, stroke.position) - stroke.position[0]
    up, down = bilinear([rate**2], [1.0, 2.0 * damping * rate, rate**2], 1.0 / _STEP)
    return np.interp(at, time, lfilter(up, down, driven))
