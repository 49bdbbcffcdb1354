"""Pose of an uncalibrated camera before the bending plane, by the two markers of one wrist at rest.

Both markers are squares of one size in one plane. An oblique camera, or a lens that bends lines, shows them otherwise:
16 coordinates tell two angles of the plane, the lens's k1 and, within what two flags may differ, their depth.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from wristctl.arrays import Array
from wristctl.config.camera import Markers
from wristctl.vision.view import View, turn

# Corners of a square of side 1, in the order of a marker's: right is real, down imaginary.
_SQUARE = 0.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
# Standard deviations before a picture is seen: of a corner, in sides; of k1; of the logarithm of the markers' sizes.
_CORNER, _LENS, _SIZES = 0.002, 0.15, 0.01
# Rounds in which a lens's distortion is taken away.
_ROUNDS = 4


class CameraPose(NamedTuple):
    """Direction of the optical axis against the bending plane, and the view that sets the plane square."""

    tilt: float
    """Of the plane about the picture's horizontal [rad]."""
    pan: float
    """About its vertical [rad]."""
    distortion: float
    """Radial distortion k1 of the lens."""
    misfit: float
    """Distance of the corners from two squares of one plane, root mean square over the side of a marker."""
    view: View

    @property
    def oblique(self) -> float:
        """Angle between the optical axis and the plane's normal [rad]."""
        return math.acos(math.cos(self.tilt) * math.cos(self.pan))

    def plain(self) -> dict[str, Any]:
        """For JSON: angles [rad], k1, misfit, and the view's matrices."""
        numbers = {name: getattr(self, name) for name in ("tilt", "pan", "oblique", "distortion", "misfit")}
        lens, plane = self.view.camera_matrix.tolist(), self.view.plane.tolist()
        return {**numbers, "camera_matrix": lens, "plane": plane, "size": self.view.size}


def pose_of(corners: Sequence[Array] | Array, picture: tuple[int, int], markers: Markers) -> CameraPose:
    """Fit the pose to frames of a wrist at rest.

    Parameters
    ----------
    corners : (n, 2, 4, 2) [px]
        Of the base's and the tip's marker, in n frames, all finite.
    picture : (width, height) [px]
        The optical axis is taken to meet its middle.
    markers : Markers
        `side` and `distance` say how many pixels a radian is.
    """
    shown = np.mean(corners, axis=0)
    centre = 0.5 * (np.array(picture) - 1.0)
    side = float(np.hypot(*(np.roll(shown, -1, axis=1) - shown).T).mean())
    focal = side * markers.distance / markers.side
    rays = (shown - centre) / focal

    def residual(x: Array) -> Array:
        off, sizes = _off_squares(rays, x)
        return np.concatenate([off.real, off.imag, [sizes - x[3], x[3] * _CORNER / _SIZES, x[2] * _CORNER / _LENS]])

    found = least_squares(residual, np.zeros(4))
    tilt, pan, lens, _ = map(float, found.x)
    off, _ = _off_squares(rays, found.x)
    matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    plane = _turned(tilt, pan).T @ np.linalg.inv(matrix)
    view = View(matrix, np.array([lens, 0.0, 0.0, 0.0]), plane, picture)
    return CameraPose(tilt, pan, lens, float(np.sqrt((np.abs(off) ** 2).mean())), view)


def _off_squares(rays: Array, x: Array) -> tuple[NDArray[np.complex128], float]:
    """Corners (8,) less those of the nearest square, in its sides; logarithm of the tip's size over the base's."""
    straight = rays
    for _ in range(_ROUNDS):
        straight = rays / (1.0 + x[2] * (straight**2).sum(axis=-1, keepdims=True))
    ahead = np.concatenate([straight, np.ones((2, 4, 1))], axis=-1) @ _turned(x[0], x[1])
    places = (ahead[..., 0] + 1j * ahead[..., 1]) / ahead[..., 2]
    places = places - places.mean(axis=1, keepdims=True)
    scale = (places @ _SQUARE.conj()) / (_SQUARE @ _SQUARE.conj())
    off: Any = (places - scale[:, None] * _SQUARE) / np.abs(scale)[:, None]
    return off.ravel(), float(np.log(np.abs(scale[1]) / np.abs(scale[0])))


def _turned(tilt: float, pan: float) -> Array:
    """Rotation (3, 3) from the plane's axes (right, down, away) to the camera's."""
    turned: Array = turn(0, tilt) @ turn(1, pan)
    return turned
