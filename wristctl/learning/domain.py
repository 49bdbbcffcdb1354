"""The region of tip positions that a data set fills, and outside of which a network only guesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.wrist.kinematics import Array, exact_arc

EDGE = 1e-9
"""Relative slack at the region's edge, so that rounding does not put an edge point outside."""


@dataclass(frozen=True)
class Domain:
    """Tips of all arcs with an angle and an arc length within these ranges, ends included."""

    theta: tuple[float, float]
    """[rad]"""
    arc_length: tuple[float, float]
    """[m]"""

    def contains(self, tip: Array) -> NDArray[np.bool_]:
        """Whether each tip (..., 2) [m] lies inside; shape (...). A tip that is not finite lies outside."""
        theta, length = exact_arc(tip)
        return _within(theta, self.theta) & _within(length, self.arc_length)


def _within(values: Array, ends: tuple[float, float]) -> NDArray[np.bool_]:
    low, high = ends
    slack = EDGE * max(abs(low), abs(high))
    return (values >= low - slack) & (values <= high + slack)
