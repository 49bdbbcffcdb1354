"""Bends (2,) from sensors of a robot's own: an inertial unit's orientation or gravity, two encoders.

Axes are those of the sensor: `along` the straight wrist toward the hand, `toward` ulnar; flexion is the third one,
right-handed. A reading that is none (not finite, or of no size) gives nan, which a rig takes for a bend not seen.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.records.inertial_units import bends_of_gravity
from wristctl.records.rigid_bodies import BodyNames, axes_of, bends_of_turns

__all__ = [
    "StraightGravity", "StraightOrientation", "bends_from_encoders", "bends_from_gravity", "bends_from_quaternion",
    "bends_from_rotation", "relative_quaternion",
]  # fmt: skip

# Norm of a quaternion that is none, and component of gravity along the wrist from which it tells bends.
_NONE, _ALONG = 0.5, 0.5
# Readings of the straight wrist whose mean is its zero.
_READINGS = 20
_UNSEEN, _STRAIGHT = np.full(2, np.nan), np.eye(3)


def _axes(along: str, toward: str) -> Array:
    """Rows (3, 3): along the wrist, toward ulnar, toward flexion. UserError for axes that are none."""
    return axes_of(BodyNames(along=along, toward=toward), Path("bend sensor"))


def relative_quaternion(base: ArrayLike, tip: ArrayLike) -> Array:
    """Orientation (4,) of a unit on the hand in the axes of one on the forearm, both w, x, y, z.

    A heading that drifts alike in both drops out, and so does every motion of the forearm.
    """
    (a, b, c, d), (e, f, g, h) = np.asarray(base, float), np.asarray(tip, float)
    return np.array(
        [
            a * e + b * f + c * g + d * h,
            a * f - b * e - c * h + d * g,
            a * g + b * h - c * e - d * f,
            a * h - b * g + c * f - d * e,
        ]
    )


def bends_from_quaternion(
    quaternion: ArrayLike, straight: ArrayLike = (1.0, 0.0, 0.0, 0.0), along: str = "x", toward: str = "y",
    upright: bool = False,
) -> Array:  # fmt: skip
    """Bends (2,) [rad] by an orientation (4,) and that of the straight wrist: w, x, y, z.

    With `upright` the straight wrist stands or hangs, and a turn about it is the heading's drift, since no wrist
    twists: it is taken out. A level wrist needs a second unit on the forearm instead (`relative_quaternion`).
    """
    from scipy.spatial.transform import Rotation

    now, zero = np.asarray(quaternion, float), np.asarray(straight, float)
    if not (np.linalg.norm(now) > _NONE and np.linalg.norm(zero) > _NONE):  # a nan is not either
        return _UNSEEN.copy()
    turn = relative_quaternion(zero, now)
    axes = _axes(along, toward)
    bends = bends_of_turns(turn[None, [1, 2, 3, 0]], axes)[0]
    if upright:
        twist = 2.0 * math.atan2(float(turn[1:] @ axes[0]), float(turn[0]))
        bends = Rotation.from_rotvec([0.0, 0.0, -twist]).apply([*bends, 0.0])[:2]
    return np.asarray(bends, float)


def bends_from_rotation(
    rotation: ArrayLike, straight: ArrayLike = _STRAIGHT, along: str = "x", toward: str = "y", upright: bool = False
) -> Array:  # fmt: skip
    """Bends (2,) [rad] by a rotation matrix (3, 3) from the sensor's axes; as `bends_from_quaternion`."""
    from scipy.spatial.transform import Rotation

    matrices = np.asarray(rotation, float), np.asarray(straight, float)
    if not all(np.isfinite(matrix).all() and np.linalg.det(matrix) > _NONE for matrix in matrices):
        return _UNSEEN.copy()
    now, zero = (Rotation.from_matrix(matrix).as_quat()[[3, 0, 1, 2]] for matrix in matrices)
    return bends_from_quaternion(now, zero, along, toward, upright)


def bends_from_gravity(gravity: ArrayLike, straight: ArrayLike, along: str = "x", toward: str = "y") -> Array:
    """Bends (2,) [rad] by gravity (3,) in the sensor's axes, in any unit, and that of the straight wrist.

    It does not drift, but quick motions shake it. nan where gravity is across the straight wrist: it tells no bend.
    """
    axes = _axes(along, toward)
    now, zero = (axes @ np.asarray(vector, float) for vector in (gravity, straight))
    sizes = float(np.linalg.norm(now)), float(np.linalg.norm(zero))
    if not (min(sizes) > 0.0 and math.isfinite(max(sizes)) and abs(zero[0]) > _ALONG * sizes[1]):
        return _UNSEEN.copy()
    bends: Array = bends_of_gravity(now[None] / sizes[0], zero / sizes[1])[0]
    return bends


def bends_from_encoders(
    angles: ArrayLike, straight: ArrayLike = (0.0, 0.0), turn: float = math.tau, senses: ArrayLike = (1.0, 1.0)
) -> Array:  # fmt: skip
    """Bends (2,) [rad] by two encoders on a universal joint: the first turns toward ulnar and carries the second.

    `turn` is what one turn counts, a jump by a turn is none; `senses` are 1 or -1 toward ulnar and flexion.
    """
    counted = (np.asarray(angles, float) - np.asarray(straight, float)) * np.asarray(senses, float) * (math.tau / turn)
    if not np.isfinite(counted).all():
        return _UNSEEN.copy()
    ulnar, flexion = (counted + math.pi) % math.tau - math.pi
    hand = np.array([math.cos(flexion) * math.cos(ulnar), math.cos(flexion) * math.sin(ulnar), math.sin(flexion)])
    across = math.hypot(hand[1], hand[2])
    bends: Array = hand[1:] * (math.atan2(across, hand[0]) / across if across > 0.0 else 1.0)
    return bends


class StraightOrientation:
    """Bends by orientations, counted from the mean of the first readings: the wrist is straight then.

    `along`, `toward` and `upright` are those of `bends_from_quaternion`.
    """

    def __init__(self, along: str = "x", toward: str = "y", upright: bool = False, readings: int = _READINGS) -> None:
        self._axes, self._upright, self._left = (along, toward), upright, readings
        self._sum = np.zeros(4)

    def bend(self, quaternion: ArrayLike) -> Array:
        """Bend (2,) [rad] of a reading w, x, y, z; nan while the zero is found."""
        now = np.asarray(quaternion, float)
        if not np.linalg.norm(now) > _NONE:
            return _UNSEEN.copy()
        if self._left > 0:  # a quaternion and its negative are one orientation
            self._left, self._sum = self._left - 1, self._sum + (now if now @ self._sum >= 0.0 else -now)
            return _UNSEEN.copy()
        return bends_from_quaternion(now, self._sum / np.linalg.norm(self._sum), *self._axes, self._upright)


class StraightGravity:
    """Bends by gravity, counted from the mean of the first readings: the wrist is straight then."""

    def __init__(self, along: str = "x", toward: str = "y", readings: int = _READINGS) -> None:
        self._axes, self._left, self._sum = (along, toward), readings, np.zeros(3)

    def bend(self, gravity: ArrayLike) -> Array:
        """Bend (2,) [rad] of a reading (3,); nan while the zero is found."""
        now = np.asarray(gravity, float)
        if not np.isfinite(now).all():
            return _UNSEEN.copy()
        if self._left > 0:
            self._left, self._sum = self._left - 1, self._sum + now
            return _UNSEEN.copy()
        return bends_from_gravity(now, self._sum, *self._axes)
