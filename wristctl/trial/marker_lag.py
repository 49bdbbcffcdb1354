"""Lag of the marker behind its motors, from the frames of a motion as they come."""

import math

import numpy as np

_LEAST_FRAMES = 20
# Standard errors.
_SURE = 3.0


class MarkerLag:
    """Lag of the marker in a motion's usable frames behind the angle that the spools should have made.

    Of theta = a + b (predicted - lag rate) by least squares, less three standard errors.
    """

    def __init__(self) -> None:
        self._count, self._squares = 0, 0.0
        self._normal, self._moments = np.zeros((3, 3)), np.zeros(3)
        self._least: float | None = None

    def add(self, theta: float, predicted: float, rate: float) -> None:
        """Take in the marker's angle, the predicted one [rad] and its rate [rad/s]."""
        terms = np.array([1.0, predicted, -rate])
        self._count, self._squares, self._least = self._count + 1, self._squares + theta * theta, None
        self._normal += np.outer(terms, terms)
        self._moments += theta * terms

    def least(self) -> float:
        """The lag [s] that there is at least; nan where the motion cannot tell."""
        if self._least is None:
            self._least = self._fitted()
        return self._least

    def _fitted(self) -> float:
        scale = np.sqrt(self._normal.diagonal())
        if self._count < _LEAST_FRAMES or not scale.all():
            return math.nan
        alike = self._normal / np.outer(scale, scale)
        if np.linalg.eigvalsh(alike)[0] < 1e-9:
            return math.nan
        inverse = np.linalg.inv(alike) / np.outer(scale, scale)
        coefficients = inverse @ self._moments
        _, share, late = coefficients
        if share <= 0.0:
            return math.nan
        left = max(0.0, self._squares - float(coefficients @ self._moments))
        variance = left / (self._count - 3) * inverse[2, 2]
        return float((late - _SURE * math.sqrt(variance)) / share)
