"""One constant-curvature arc in the plane (E1), its inverse, and its tip along paths; NumPy, any batch shape."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters


@dataclass(frozen=True)
class TipPath:
    """Wanted tip positions in P planes on a time grid of T samples."""

    position: Array
    """(T, P + 1) [m]"""
    velocity: Array
    """(T, P + 1) [m/s]"""
    acceleration: Array
    """(T, P + 1) [m/s^2]"""


@dataclass(frozen=True)
class AnglePath:
    """The bending angles that an inverse gives for a tip path."""

    theta: Array
    """(T,), in two planes (T, 2) [rad]"""
    rate: Array
    """(T,) or (T, 2) [rad/s]"""
    acceleration: Array
    """(T,) or (T, 2) [rad/s^2]"""
    outside: NDArray[np.bool_]
    """(T,) true where the tip lies outside the inverse's domain, so that its angle means nothing"""


# Network from tip positions to bending angles.
Inverse = Callable[[TipPath], AnglePath]


def arc_tip(theta: Array, length: Array | float) -> Array:
    """Tip of an arc of angle theta [rad] and length [m], (..., 2) [m]: l sin(x)/x (cos x, sin x) with x = theta/2."""
    chord = length * np.sinc(theta / (2.0 * np.pi))
    return np.stack([chord * np.cos(0.5 * theta), chord * np.sin(0.5 * theta)], axis=-1)


def chain_tip(segment_theta: Array, length: Array | float) -> Array:
    """Tips (T, 2) [m] of chains of equal arcs with angles (T, n) [rad] and a total length [m] (E1)."""
    n = segment_theta.shape[1]
    before = np.cumsum(segment_theta, axis=1) - segment_theta
    arcs = arc_tip(segment_theta, length / n)
    place = (arcs[..., 0] + 1j * arcs[..., 1]) * np.exp(1j * before)
    end = place.sum(axis=1)
    return np.stack([end.real, end.imag], axis=-1)


def exact_angle(tip: Array) -> Array:
    """Bending angle [rad] of the arc from the base to each tip (..., 2) [m]; shape (...), in (-2 pi, 2 pi]."""
    angle: Array = 2.0 * np.arctan2(tip[..., 1], tip[..., 0])
    return angle


def exact_arc(tip: Array) -> tuple[Array, Array]:
    """Bending angle [rad] and arc length [m] of the arc from the base to each tip (..., 2) [m]; shapes (...)."""
    theta = exact_angle(tip)
    with np.errstate(divide="ignore", invalid="ignore"):  # straight back: a full circle has no chord
        length = np.hypot(tip[..., 0], tip[..., 1]) / np.sinc(theta / (2.0 * np.pi))
    return theta, length


def arc_path(theta: Array, length: Array) -> TipPath:
    """Tips of an arc whose angle and length move; rows of both are value, rate and acceleration, (3, T)."""
    rows = np.concatenate([theta, length])
    moved = np.append(True, (rows[:, 1:] != rows[:, :-1]).any(axis=0))  # where it rests all is as before
    q, dq, ddq, r, dr, ddr = rows[:, moved, None]
    f, df, ddf = unit_arc(q[:, 0])
    velocity, acceleration = dr * f + r * dq * df, ddr * f + 2.0 * dr * dq * df + r * (ddq * df + dq**2 * ddf)
    place = np.cumsum(moved) - 1
    return TipPath((r * f)[place], velocity[place], acceleration[place])


def unit_arc(theta: Array) -> tuple[Array, Array, Array]:
    """Tip of the unit arc, the integral of exp(i theta s) over s in [0, 1], and two derivatives, each (T, 2).

    By Gauss-Legendre quadrature: to rounding for |theta| <= 2 pi, and nothing special at 0.
    """
    nodes, weights = _gauss_legendre()
    tips = np.zeros((3, len(theta)), complex)
    for node, weight in zip(nodes, weights, strict=True):  # a matrix product sums in an order of the processor's own
        wave = weight * np.exp(1j * theta * node)
        for k in range(3):
            tips[k] += wave
            wave = wave * (1j * node)
    return tuple(np.stack([v.real, v.imag], axis=-1) for v in tips)  # type: ignore[return-value]


@cache
def _gauss_legendre() -> tuple[Array, Array]:
    """Nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    return 0.5 * (nodes + 1.0), 0.5 * weights


Planar = NDArray[np.complex128]
# A plant's points and unit tangents, (m,) each, at its coordinates (q,) and the arc lengths (m,) [m].
Backbone = Callable[[WristParameters, Array, Array], tuple[Planar, Planar]]


def arcs_backbone(wrist: WristParameters, segment_theta: Array, lengths: Array) -> tuple[Planar, Planar]:
    """Points and unit tangents of a chain of equal arcs at the arc lengths `lengths` (m,) [m]; each (m,)."""
    arc_length = wrist.length / len(segment_theta)
    along = np.clip(lengths[:, None] - arc_length * np.arange(len(segment_theta)), 0.0, arc_length)
    bent = segment_theta * along / arc_length
    before = np.cumsum(segment_theta) - segment_theta
    arcs = arc_tip(bent, along)
    points = ((arcs[..., 0] + 1j * arcs[..., 1]) * np.exp(1j * before)).sum(axis=1)
    return points, np.exp(1j * bent.sum(axis=1))


def discs(line: Backbone, q: Array, wrist: WristParameters) -> tuple[Planar, Planar]:
    """Centres and unit normals (along the backbone) of a wrist's discs, the first at the base, the last at the tip."""
    return line(wrist, q, np.linspace(0.0, wrist.length, wrist.discs))


def offset_points(frames: tuple[Planar, Planar], offset: float) -> Planar:
    """Points of the discs at `offset` [m] from the backbone, toward +y on the straight wrist."""
    centres, normals = frames
    return centres + 1j * offset * normals
