"""What moves before a camera: the wrist in its bending plane, or in both planes, by its plant's coordinates.

Points are as a camera of the scene has them: x along the base's tangent, y toward its plane's + side, depth away from
it.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.vision.scene_parts import Stroke, bent_across, flat, moving, with_last_disc
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


class Body:
    """A wrist with its hand; `across` is a bend away from the camera [rad] beside its coordinates q."""

    def __init__(self, wrist: WristParameters, end: float, edge_on: bool) -> None:
        self._wrist, self._end, self._edge_on = wrist, end, edge_on

    def strokes(self, q: Array) -> list[Stroke]:
        """Everything that moves, without the bend across."""
        line, _ = self._frames(q, np.linspace(0.0, self._end, 24))
        return moving(line, self._frames(q, np.linspace(0.0, self._end, self._wrist.discs)), self._wrist, self._edge_on)

    def carry(self, across: float) -> Carry:
        """What the bend across does to the strokes: nothing, where the coordinates have both bends."""
        return lambda points: points

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc."""
        raise NotImplementedError

    def _frames(self, q: Array, places: Array) -> tuple[Array, Array]:
        """Centres (m, 3) [m] and rotations (m, 3, 3) of cross-sections at places (m,) from 0 to the end."""
        raise NotImplementedError


class PlanarBody(Body):
    """The wrist of a plant in one plane, bent across by a constant curvature."""

    def __init__(self, backbone: Backbone, wrist: WristParameters) -> None:
        super().__init__(wrist, wrist.length, edge_on=False)
        self._backbone = backbone

    def carry(self, across: float) -> Carry:
        """By the bend across."""
        return lambda points: bent_across(points, across, self._wrist.length)

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc in the plane, carried by the bend across."""
        (centre,), (normal,) = self._backbone(self._wrist, q, np.array([self._end]))
        place, length = (complex(centre), complex(normal)), self._wrist.length
        return Disc(*place, lambda points: with_last_disc(points, across, length, place), self.carry(across))

    def _frames(self, q: Array, places: Array) -> tuple[Array, Array]:
        centres, normals = self._backbone(self._wrist, q, places)
        turned = np.zeros((len(places), 3, 3))
        turned[:, 0, 0] = turned[:, 1, 1] = normals.real
        turned[:, 1, 0], turned[:, 0, 1], turned[:, 2, 2] = normals.imag, -normals.imag, 1.0
        return flat(centres, 0.0), turned


class SpatialBody(Body):
    """The wrist of a plant in two planes, before the camera that looks at one of them.

    `side` is 1 where that camera sees its plane's + side on the right. Tangent, ulnar and flexion are right-handed: the
    ulnar plane's camera has flexion behind the wrist, the other one ulnar before it.
    """

    def __init__(self, frames: Frames, wrist: WristParameters, plane: Literal[0, 1], side: float) -> None:
        super().__init__(wrist, 1.0, edge_on=plane == 1)
        self._frames_of = frames
        own, away = ([0.0, 1.0, 0.0], [0.0, 0.0, side]) if plane == 0 else ([0.0, 0.0, 1.0], [0.0, -side, 0.0])
        self._axes = np.array([[1.0, 0.0, 0.0], own, away])

    def disc(self, q: Array, across: float) -> Disc:
        """The last disc, carried from where a straight wrist of no length would have it."""
        centres, frames = self._frames(q, np.ones(1))

        def placed(points: Array) -> Array:
            moved: Array = centres[0] + points @ frames[0].T
            return moved

        return Disc(0j, 1.0 + 0j, placed, placed)

    def _frames(self, q: Array, places: Array) -> tuple[Array, Array]:
        centres, frames = self._frames_of(self._wrist, q, places)
        return centres @ self._axes.T, self._axes @ frames @ self._axes.T
