"""The region of inputs that a data set fills, and outside of which a network only guesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.wrist.kinematics import exact_arc

# Relative slack at the region's edge, so that rounding does not put an edge point outside.
EDGE = 1e-9

# Inputs that may follow x and y, with their units: tilt of the base from upright, mass of hand and payload.
OTHERS = {"pose": "rad", "hand_mass": "kg"}

Range = tuple[float, float]


@dataclass(frozen=True)
class Domain:
    """Inputs whose tip is that of an arc with angle and length in these ranges, and whose others are in theirs."""

    theta: Range
    """[rad]"""
    arc_length: Range
    """[m]"""
    others: tuple[Range, ...] = ()
    """ranges of the inputs after x and y"""

    def contains(self, inputs: Array) -> NDArray[np.bool_]:
        """Whether each row (..., 2 + others) lies inside; shape (...). What is not finite lies outside."""
        theta, length = exact_arc(inputs[..., :2])
        inside = _within(theta, self.theta) & _within(length, self.arc_length)
        for column, ends in enumerate(self.others, start=2):
            inside = inside & _within(inputs[..., column], ends)
        return inside

    def at(self, others: Array) -> Domain:
        """The tips that are inside together with these values of the other inputs; none where those are outside."""
        inside = all(bool(_within(value, ends)) for value, ends in zip(others, self.others, strict=True))
        return Domain(self.theta, self.arc_length) if inside else Domain((1.0, -1.0), (1.0, -1.0))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is inside."""
        return self.theta[0] > self.theta[1]

    @staticmethod
    def around(tip: Array, others: Array) -> Domain:
        """The smallest one that holds these tips (N, 2) [m] and other inputs (N, K)."""
        theta, length = exact_arc(tip)
        columns = [(float(values.min()), float(values.max())) for values in (theta, length, *others.T)]
        return Domain(columns[0], columns[1], tuple(columns[2:]))


def _within(values: Array, ends: Range) -> NDArray[np.bool_]:
    low, high = ends
    slack = EDGE * max(abs(low), abs(high))
    return (values >= low - slack) & (values <= high + slack)
