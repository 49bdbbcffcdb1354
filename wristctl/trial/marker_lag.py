"""How long the tip's marker comes after its motors: old pictures, soft tendons and friction look alike here."""

from __future__ import annotations

import math

import numpy as np

_LEAST_FRAMES = 20
_SURE = 3.0
"""Standard errors."""


class MarkerLag:
    """Of the usable frames of a motion, with what the spools should have made of the wrist when each was taken."""

    def __init__(self) -> None:
        self._frames: list[tuple[float, float, float]] = []

    def add(self, theta: float, predicted: float, rate: float) -> None:
        """Take in the marker's angle, the predicted one [rad] and its rate [rad/s]."""
        self._frames.append((theta, predicted, rate))

    def least(self) -> float:
        """The lag [s] that there is at least; -inf where the motion cannot tell.

        Of theta = a + b (predicted - lag rate) by least squares, less three standard errors.
        """
        theta, predicted, rate = np.array(self._frames).reshape(-1, 3).T
        if len(theta) < _LEAST_FRAMES:
            return -math.inf
        terms = np.stack([np.ones_like(theta), predicted, -rate], axis=1)
        found, _, rank, _ = np.linalg.lstsq(terms, theta)
        _, scale, late = found
        if rank < terms.shape[1] or scale <= 0.0:
            return -math.inf
        left = theta - terms @ found
        variance = float(left @ left) / (len(theta) - terms.shape[1]) * np.linalg.inv(terms.T @ terms)[2, 2]
        return float((late - _SURE * math.sqrt(variance)) / scale)
