"""Ellipse of a following error in two planes: how far it spreads along which direction, by its covariance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array


class ErrorEllipse(NamedTuple):
    """Principal axes of an error's covariance about its mean."""

    major: float
    """Standard deviation of the error along the longer axis [rad]."""
    minor: float
    """The same across it [rad]."""
    toward: float
    """Direction of the longer axis [rad], from ulnar toward flexion, above -pi/2 and up to pi/2."""

    @property
    def covariance(self) -> Array:
        """Of the error (2, 2) [rad^2]."""
        axis = np.array([math.cos(self.toward), math.sin(self.toward)])
        across = np.array([-axis[1], axis[0]])
        covariance: Array = self.major**2 * np.outer(axis, axis) + self.minor**2 * np.outer(across, across)
        return covariance

    def outline(self, deviations: float) -> Array:
        """Closed line (K, 2) [rad] at so many standard deviations about the mean."""
        turn = np.linspace(0.0, math.tau, 121)
        along, across = self.major * np.cos(turn), self.minor * np.sin(turn)
        cosine, sine = math.cos(self.toward), math.sin(self.toward)
        return deviations * np.column_stack([cosine * along - sine * across, sine * along + cosine * across])


def error_ellipse(error: Array) -> ErrorEllipse:
    """The ellipse of an error (N, 2) [rad], toward ulnar and toward flexion."""
    return _ellipse_of(np.cov(error.T, bias=True))


def mean_ellipse(ellipses: Sequence[ErrorEllipse]) -> ErrorEllipse:
    """The ellipse of the mean covariance: directions of ellipses have no mean of their own."""
    return _ellipse_of(np.mean([ellipse.covariance for ellipse in ellipses], axis=0))


def _ellipse_of(covariance: Array) -> ErrorEllipse:
    (ulnar, both), (_, flexion) = covariance.tolist()
    middle, half = 0.5 * (ulnar + flexion), math.hypot(0.5 * (ulnar - flexion), both)
    toward = 0.5 * math.atan2(both, 0.5 * (ulnar - flexion))
    return ErrorEllipse(math.sqrt(middle + half), math.sqrt(max(0.0, middle - half)), toward)
