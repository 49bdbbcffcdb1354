"""Parts of the scene before a camera, as outlines and lines in space: clamp, discs, springs, tendons, hand."""

import cmath
import math
from functools import cache
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.kinematics import Planar

_FINGERTIPS = ((1.7, -0.35), (1.82, -0.12), (1.75, 0.12), (1.5, 0.35))


def coil(start: Any, end: Any, radius: float, turns: int = 4) -> Planar:
    """A spring from start to end (complex), seen from the side; of several, (k, 1), one in each row."""
    share = np.linspace(0.0, 1.0, 16 * turns + 1)
    across = 1j * (end - start) / abs(end - start)
    points: Planar = start + share * (end - start) + radius * np.sin(2.0 * np.pi * turns * share) * across
    return points


def capsule(start: complex, end: complex, radius: float) -> Planar:
    """Outline of everything within `radius` of the line from start to end."""
    half = radius * np.exp(1j * np.linspace(-0.5 * np.pi, 0.5 * np.pi, 16))
    along = (end - start) / abs(end - start)
    return np.concatenate([end + along * half, start - along * half])


def hand(size: float, edge_on: bool) -> list[Planar]:
    """Outlines of a hand's parts beyond a disc at 0 facing +x; it is about twice `size` [m] long.

    Seen on the palm with the little finger toward +y, or `edge_on` with the palm toward +y.
    """
    if edge_on:
        parts = [((0.15, 0.0), (0.95, 0.0), 0.15), ((1.0, 0.0), (1.85, 0.12), 0.1), ((0.45, 0.12), (0.95, 0.38), 0.09)]
    else:
        fingers = [((0.9, 0.85 * end), (tip, end), 0.09) for tip, end in _FINGERTIPS]
        parts = [((0.36, 0.0), (0.72, 0.0), 0.36), *fingers, ((0.45, -0.28), (0.95, -0.68), 0.1)]
    return [size * capsule(complex(*start), complex(*end), radius) for start, end, radius in parts]


# Radius of the discs over that of the circle of tendons; their thickness [m].
RIM, THICK = 1.25, 0.0035
# Grey of a disc's upper face, to which the light comes.
FACE = 196
# Middle of the base's marker, which is on the clamp, along x [m].
BASE_AT = -0.022
_CLAMP_FOOT, _CLAMP_HALF, _CLAMP_DEPTH = -0.050, 0.036, 0.024
_FINGERS = ((0.004 + 0.004j, 0.016 + 0.18j), (-0.010 + 0.002j, -0.008 + 0.18j))
_AROUND = np.linspace(0.0, 2.0 * np.pi, 36)


class Stroke(NamedTuple):
    """Something drawn in one grey, over what was drawn before."""

    points: Array
    """(m, 3) along x, along y, depth away from the camera [m]"""
    grey: int
    how: Literal["line", "fill", "hull", "face"]
    """A line; a filled outline; what holds all the points, filled and edged; an outline filled if it turns clockwise
    from x to depth for the camera"""
    thickness: int = 1
    """Thickness of a line [px]"""


def clamp() -> list[Stroke]:
    """Table, and the vice that holds the first disc."""
    table = _box((_CLAMP_FOOT - 0.02, _CLAMP_FOOT), (-0.3, 0.3), (-0.05, 0.3))
    body = _box((_CLAMP_FOOT, -0.5 * THICK), (-_CLAMP_HALF, _CLAMP_HALF), (-_CLAMP_DEPTH, _CLAMP_DEPTH))
    front = body[[0, 2, 6, 4]]
    places = [complex(x, y) for x in (-0.041, -0.009) for y in (-0.029, 0.029)]
    screws = [flat(place + 0.0035 * np.exp(1j * _AROUND), -_CLAMP_DEPTH) for place in places]
    return [
        Stroke(table, 84, "hull"),
        Stroke(body, 58, "hull"),
        Stroke(front, 76, "hull"),
        *(Stroke(screw, 128, "hull") for screw in screws),
    ]


def moving(line: Array, frames: tuple[Array, Array], wrist: WristParameters, edge_on: bool) -> list[Stroke]:
    """The wrist and its hand, seen on the palm or `edge_on`.

    `line` (m, 3) is its backbone [m], `frames` are centres (discs, 3) [m] and rotations (discs, 3, 3) of its discs.
    """
    centres, turned = frames
    c, radius = wrist.tendon_offset, RIM * wrist.tendon_radius
    parts = [
        Stroke(centres[-1] + flat(outline, 0.0) @ turned[-1].T, 164, "hull")
        for outline in _hand(max(wrist.hand_offset, 0.02), edge_on)
    ]
    parts += _pairs(centres, turned, c, behind=True)
    parts.append(Stroke(line, 92, "line", 4))
    for centre, frame in zip(centres, turned, strict=True):
        rims = [centre + _rim(end * THICK, radius) @ frame.T for end in (-0.5, 0.5)]
        parts.append(Stroke(np.concatenate(rims), 150, "hull"))
        parts += [Stroke(rims[0], 118, "face"), Stroke(rims[1][::-1], FACE, "face")]
    return parts + _pairs(centres, turned, c, behind=False)


def bent_across(points: Array, bend: float, length: float) -> Array:
    """Points (m, 3) that a bend [rad] away from the camera carries along, of constant curvature up to x = `length`.

    The bend goes by the height x of a point, though a wrist that is bent in its plane too is a little longer than it
    is high, at 30 degrees by 4 %, and discs would curl: what is measured goes `with_last_disc`.
    """
    if not bend:
        return points
    x, y, depth = points.T
    along = np.clip(x, 0.0, length)
    angle = bend / length * along
    beyond = x - along
    ahead = 0.5 * along * np.sinc(0.5 * angle / np.pi)  # the chord is twice that long, and half the angle off
    raised = 2.0 * ahead * np.cos(0.5 * angle) + beyond * np.cos(angle) - depth * np.sin(angle)
    away = 2.0 * ahead * np.sin(0.5 * angle) + beyond * np.sin(angle) + depth * np.cos(angle)
    return np.stack([raised, y, away], axis=-1)


def with_last_disc(points: Array, bend: float, length: float, disc: tuple[complex, complex]) -> Array:
    """Points (m, 3) fixed to the last disc (its centre [m] and unit normal), which such a bend carries along as it is.

    Of constant curvature in both planes: the wrist is one arc, in a plane of its own.
    """
    if not bend:
        return points
    centre, theta = np.array([disc[0].real, disc[0].imag, 0.0]), cmath.phase(disc[1])
    turned = _turned(theta, bend) @ _turned(theta, 0.0).T
    moved = centre + length * (_arc_end(theta, bend) - _arc_end(theta, 0.0))
    turned_points: Array = moved + (points - centre) @ turned.T
    return turned_points


def _turned(theta: float, bend: float) -> Array:
    return np.asarray(cv2.Rodrigues(np.array([0.0, -bend, theta]))[0])


def _arc_end(theta: float, bend: float) -> Array:
    """End of an arc of length 1 that begins along x and bends toward y and depth."""
    angle = math.hypot(theta, bend)
    aside = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.array([np.sinc(angle / np.pi), aside * theta, aside * bend])


def fingers(tip: complex, along: complex, depth: float) -> list[Stroke]:
    """Two fingers of somebody who holds the last disc, over its marker."""
    return [Stroke(flat(tip + along * capsule(*ends, 0.0085), depth), 172, "hull") for ends in _FINGERS]


def _pairs(centres: Array, turned: Array, c: float, behind: bool) -> list[Stroke]:
    """On either side the tendon and the springs around it, behind the backbone or in front of it."""
    parts = []
    for offset in (-c, c):
        tendon = centres + turned @ np.array([0.0, offset, c if behind else -c])
        beside = tendon[:, 0] + 1j * tendon[:, 1]
        springs = coil(beside[:-1, None], beside[1:, None], 0.17 * c, turns=3)[:, ::2]
        depth = np.linspace(tendon[:-1, 2], tendon[1:, 2], springs.shape[1], axis=-1)
        wound = np.stack([springs.real, springs.imag, depth], axis=-1).reshape(-1, 3)
        parts.append(Stroke(wound, 140 if behind else 158, "line"))
        parts.append(Stroke(tendon, 62 if behind else 40, "line", 2))
    return parts


@cache
def _hand(size: float, edge_on: bool) -> list[Planar]:
    """From back to front: as the palm is over the roots of the fingers."""
    return hand(size, edge_on)[:: 1 if edge_on else -1]


def _rim(at: float, radius: float) -> Array:
    return np.stack([np.full(len(_AROUND), at), radius * np.cos(_AROUND), radius * np.sin(_AROUND)], axis=-1)


def flat(places: Planar, depth: float) -> Array:
    """Points (m, 3) at these places (m,) of the plane x + i y, in this depth [m]."""
    return np.stack([places.real, places.imag, np.full(len(places), depth)], axis=-1)


def _box(x: tuple[float, float], y: tuple[float, float], depth: tuple[float, float]) -> Array:
    return np.array([[a, b, c] for a in x for b in y for c in depth])
