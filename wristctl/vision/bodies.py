"""What moves before a camera: the wrist in its bending plane, or in both planes, by its plant's coordinates.

Points are as a camera of the scene has them: x along the base's tangent, y toward its plane's + side, depth away from
it.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.vision.scene_parts import Stroke, bent_across, last_disc, moving, moving_in_space, with_last_disc
from wristctl.wrist.kinematics import Backbone

# Points (m, 3) [m] moved to where they are.
Carry = Callable[[Array], Array]
# `frames` of a plant in two planes.
Frames = Callable[[WristParameters, Array, Array], tuple[Array, Array]]


class Disc(NamedTuple):
    """The last disc: what is fixed to it is placed by centre and normal in the plane, then carried."""

    centre: complex
    normal: complex
    marker: Carry
    """Of points on its marker."""
    grip: Carry
    """Of the fingers that hold it."""


class Body(Protocol):
    """A wrist with its hand; `across` is a bend away from the camera [rad] beside its coordinates q."""

    def strokes(self, q: Array) -> list[Stroke]:
        """Everything that moves."""

    def carry(self, across: float) -> Carry:
        """What the bend across does to its strokes."""

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc."""


class PlanarBody:
    """The wrist of a plant in one plane, bent across by a constant curvature."""

    def __init__(self, backbone: Backbone, wrist: WristParameters) -> None:
        self._backbone, self._wrist = backbone, wrist

    def strokes(self, q: Array) -> list[Stroke]:
        """Everything that moves, in the plane."""
        return moving(self._backbone, q, self._wrist)

    def carry(self, across: float) -> Carry:
        """By the bend across."""
        return lambda points: bent_across(points, across, self._wrist.length)

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc in the plane, carried by the bend across."""
        place, length = last_disc(self._backbone, q, self._wrist), self._wrist.length
        return Disc(*place, lambda points: with_last_disc(points, across, length, place), self.carry(across))


class SpatialBody:
    """The wrist of a plant in two planes, before the camera that looks at one of them.

    `side` is 1 where that camera sees its plane's + side on the right. Tangent, ulnar and flexion are right-handed: the
    ulnar plane's camera has flexion behind the wrist, the other one ulnar before it.
    """

    def __init__(self, frames: Frames, wrist: WristParameters, plane: Literal[0, 1], side: float) -> None:
        self._frames_of, self._wrist, self._edge_on = frames, wrist, plane == 1
        own, away = ([0.0, 1.0, 0.0], [0.0, 0.0, side]) if plane == 0 else ([0.0, 0.0, 1.0], [0.0, -side, 0.0])
        self._axes = np.array([[1.0, 0.0, 0.0], own, away])

    def strokes(self, q: Array) -> list[Stroke]:
        """Everything that moves."""
        line, _ = self._frames(q, np.linspace(0.0, 1.0, 24))
        frames = self._frames(q, np.linspace(0.0, 1.0, self._wrist.discs))
        return moving_in_space(line, frames, self._wrist, self._edge_on)

    def carry(self, across: float) -> Carry:
        """Nothing: coordinates have both bends."""
        return lambda points: points

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc, carried from where a straight wrist of no length would have it."""
        centres, frames = self._frames(q, np.ones(1))

        def placed(points: Array) -> Array:
            moved: Array = centres[0] + points @ frames[0].T
            return moved

        return Disc(0j, 1.0 + 0j, placed, placed)

    def _frames(self, q: Array, shares: Array) -> tuple[Array, Array]:
        """Centres (m, 3) [m] and rotations (m, 3, 3) of cross-sections at shares (m,) of the length."""
        centres, frames = self._frames_of(self._wrist, q, shares)
        return centres @ self._axes.T, self._axes @ frames @ self._axes.T
