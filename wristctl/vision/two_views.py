"""Bends of a wrist in two planes, each from the camera that looks at its plane.

A camera sees the sides of the tip's marker, which run along the last disc's tangent. Each side's picture and the
camera's centre span a plane that the tangent lies in, whatever the perspective. With the other plane's bend known, that
is one equation for the bend in this one.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.vision.detector import side_angle
from wristctl.vision.marker import Sighting
from wristctl.vision.view import View

# Rounds of Newton's method at most, the change [rad] after which there are no more, and the step of its slope [rad].
_ROUNDS, _ENOUGH, _STEP = 20, 1e-12, 1e-6
# Time [s] from a frame within which the other camera has to have seen the wrist.
NEAR = 0.05
# Times that each plane's bends are found by the other's: each turn leaves a tenth of the error.
_TURNS = 5


def bend_seen(sighting: Sighting, view: View, other: float, zero: float = 0.0, side: float = 1.0) -> float:
    """Bend of the last disc [rad] about the sighting's own plane.

    Of a view that is calibrated, or set square by `Tracker.stand_square`, exact under perspective. Of another, or
    without the marker's corners, the sighting's angle is taken for that of the tangent as seen from far away.

    Parameters
    ----------
    sighting
        Sighting of one camera; the bend is nan where its angle is.
    view
        That camera's view.
    other
        Bend about the other plane [rad], as it is estimated.
    zero
        Angle [rad] by which the tip's marker is turned on its flag, which has been taken off the sighting's. Without
        it the base's marker is taken to be turned by as much the other way.
    side
        1 where the camera sees its plane's positive bends on the right, -1 on the left.
    """
    theta = sighting.theta
    if not math.isfinite(theta):
        return math.nan
    corners = sighting.corners[1]
    if view.size is None or not np.isfinite(corners).all():
        return _root(np.array([-math.sin(theta), math.cos(theta), 0.0]), 0.0, other, theta)
    base = side_angle(view.rectify(corners)) - side * (theta + zero)
    c, s = math.cos(base), math.sin(base)
    away = side if sighting.plane == 0 else -side  # toward flexion is away from the first, toward ulnar to the second
    axes = np.array([[s, -c, 0.0], [side * c, side * s, 0.0], [0.0, 0.0, away]])  # on the plane's right, down, away
    return _root(axes @ _normal(corners, view), zero, other, theta)


def paired_bends(
    sightings: Sequence[Sequence[Sighting]], views: Sequence[View], zeros: Sequence[float], sides: Sequence[float]
) -> list[Array]:
    """Bends [rad] about the planes of two cameras at their frames, each by what the other sees around that time.

    `views`, `zeros` and `sides` are those of each camera, as `bend_seen` takes them. nan where a frame has no angle,
    or the other camera none before and after it, and one within NEAR.
    """
    times = [np.array([sighting.time for sighting in of_camera]) for of_camera in sightings]
    thetas = [np.array([sighting.theta for sighting in of_camera]) for of_camera in sightings]
    shown = [np.isfinite(theta) for theta in thetas]
    if not all(own.any() for own in shown):
        return [np.full(len(theta), math.nan) for theta in thetas]
    bends = thetas
    for _ in range(_TURNS):
        guess = [np.where(np.isfinite(bend), bend, theta) for bend, theta in zip(bends, thetas, strict=True)]
        others = [np.interp(times[p], times[1 - p][shown[1 - p]], guess[1 - p][shown[1 - p]]) for p in range(2)]
        bends = [
            np.array([bend_seen(each, views[p], other, zeros[p], sides[p]) for each, other in zip(*both, strict=True)])
            for p, both in enumerate(zip(sightings, others, strict=True))
        ]
    return [np.where(_seen_beside(times[p], times[1 - p][shown[1 - p]]), bends[p], math.nan) for p in range(2)]


def _seen_beside(times: Array, known: Array) -> NDArray[np.bool_]:
    after = np.searchsorted(known, times)
    before, at_or_after = known[np.maximum(after - 1, 0)], known[np.minimum(after, len(known) - 1)]
    near = np.minimum(np.abs(times - before), np.abs(times - at_or_after)) <= NEAR
    within: NDArray[np.bool_] = near & (known[0] <= times) & (times <= known[-1])
    return within


def _normal(corners: Array, view: View) -> Array:
    """Sum of the normals of the planes through the camera's centre and either side of a marker.

    In the bending plane's axes: right, down, away from the camera.
    """
    inverse = np.linalg.inv(view.camera_matrix)
    pixels = view.undistort(corners) if view.distortion.any() else corners
    rays = np.column_stack([pixels, np.ones(4)]) @ inverse.T
    onto = inverse @ np.linalg.inv(view.plane)
    right, down = (axis / np.linalg.norm(axis) for axis in onto[:, :2].T * np.sign(onto[2, 2]))
    sides = np.cross(rays[3], rays[0]) + np.cross(rays[2], rays[1])
    normal: Array = np.stack([right, down, np.cross(right, down)]) @ sides
    return normal / np.linalg.norm(normal)


def _root(normal: Array, zero: float, other: float, guess: float) -> float:
    """Bend [rad] at which the marker's sides are across this normal (along, toward this plane's + side, the other's).

    nan where there is none.
    """
    bend = guess
    for _ in range(_ROUNDS):
        off = float(normal @ _sides(bend, other, zero))
        slope = (float(normal @ _sides(bend + _STEP, other, zero)) - off) / _STEP
        if slope == 0.0:
            return math.nan
        change = max(-0.5, min(0.5, -off / slope))
        bend += change
        if abs(change) < _ENOUGH:
            break
    return bend if abs(change) < 1e-9 and abs(bend) < math.pi else math.nan


def _sides(bend: float, other: float, zero: float) -> Array:
    """Direction (3,) of the sides of a marker turned by `zero` on the last disc of an arc with these bends."""
    size = math.hypot(bend, other)
    sinc, half = float(np.sinc(size / math.pi)), float(np.sinc(0.5 * size / math.pi))
    c, c2 = math.cos(size), 0.5 * half * half
    along = np.array([c, sinc * bend, sinc * other])
    across = np.array([-sinc * bend, 1.0 - c2 * bend * bend, -c2 * bend * other])
    sides: Array = math.cos(zero) * along + math.sin(zero) * across
    return sides
