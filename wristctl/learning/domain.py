"""The region of inputs that a data set fills, and outside of which a network only guesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.wrist.kinematics import exact_arc
from wristctl.wrist.spatial.spatial_kinematics import exact_bend

# Relative slack at the region's edge, so that rounding does not put an edge point outside.
EDGE = 1e-9

# Inputs that may follow the tip, with their units: tilt of the base from upright, direction in which it is tilted, from
# ulnar toward flexion, mass of hand and payload.
OTHERS = {"pose": "rad", "roll": "rad", "hand_mass": "kg"}

# Directions around the straight wrist in which the reach of samples in two planes is kept.
AROUND = 72

Range = tuple[float, float]


@dataclass(frozen=True)
class Domain:
    """Inputs whose tip is that of an arc with angle and length in these ranges, and whose others are in theirs.

    In two planes the angle is the size of the bend, which lies within the convex region that `reach` encloses.
    """

    theta: Range
    """[rad]"""
    arc_length: Range
    """[m]"""
    others: tuple[Range, ...] = ()
    """ranges of the inputs after the tip"""
    reach: tuple[float, ...] = ()
    """in two planes the farthest bends toward AROUND directions, from ulnar toward flexion [rad]"""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return 2 if self.reach else 1

    def contains(self, inputs: Array) -> NDArray[np.bool_]:
        """Whether each row (..., P + 1 + others) lies inside; shape (...). What is not finite lies outside."""
        first = self.planes + 1
        theta, length = arc_to(inputs[..., :first])
        inside = _within(length, self.arc_length)
        if self.planes == 1:
            inside = inside & _within(theta, self.theta)
        else:
            inside = inside & _within(np.hypot(*np.moveaxis(theta, -1, 0)), self.theta)
            farthest = np.array(self.reach) + EDGE * self.theta[1]
            inside = inside & (theta @ _directions().T <= farthest).all(axis=-1)
        for column, ends in enumerate(self.others, start=first):
            inside = inside & _within(inputs[..., column], ends)
        return inside

    def at(self, others: Array) -> Domain:
        """The tips that are inside together with these values of the other inputs; none where those are outside."""
        inside = all(bool(_within(value, ends)) for value, ends in zip(others, self.others, strict=True))
        ends = (self.theta, self.arc_length) if inside else ((1.0, -1.0), (1.0, -1.0))
        return Domain(*ends, reach=self.reach)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is inside."""
        return self.theta[0] > self.theta[1]

    @staticmethod
    def around(tip: Array, others: Array) -> Domain:
        """The smallest one that holds these tips (N, P + 1) [m] and other inputs (N, K)."""
        theta, length = arc_to(tip)
        size = theta if theta.ndim == 1 else np.hypot(*theta.T)
        columns = [(float(values.min()), float(values.max())) for values in (size, length, *others.T)]
        reach = () if theta.ndim == 1 else tuple((theta @ _directions().T).max(axis=0).tolist())
        return Domain(columns[0], columns[1], tuple(columns[2:]), reach)

    @staticmethod
    def disc(bend: float, arc_length: Range) -> Domain:
        """All bends in two planes up to this size [rad]."""
        return Domain((0.0, bend), arc_length, reach=(bend,) * AROUND)


def arc_to(tip: Array) -> tuple[Array, Array]:
    """Bend [rad] and length (...) [m] of the one arc from the base to each tip (..., P + 1) [m].

    The bend is of shape (...), in two planes (..., 2).
    """
    return exact_arc(tip) if tip.shape[-1] == 2 else exact_bend(tip)


def _directions() -> Array:
    """Unit vectors (AROUND, 2) from ulnar toward flexion."""
    around = 2.0 * np.pi * np.arange(AROUND) / AROUND
    return np.stack([np.cos(around), np.sin(around)], axis=-1)


def _within(values: Array, ends: Range) -> NDArray[np.bool_]:
    low, high = ends
    slack = EDGE * max(abs(low), abs(high))
    return (values >= low - slack) & (values <= high + slack)
