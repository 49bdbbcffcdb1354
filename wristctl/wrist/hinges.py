"""A wrist of rigid links as a plant: between two discs a hinge with a spring, which may be stiffer toward the base.

No constant curvature: a part of length l goes straight to the hinge in its middle and straight on. Its chord is
l/2 (1 + exp(i q)) in the axes of the disc before it; tendons run straight from a disc's hole to the next one's, so they
are l cos(q/2) -+ 2 c sin(q/2) long. There is a disc at either end of every part, however many the wrist is cut into:
tendons squeeze fewer parts than the discs' gaps more than the wrist. Masses are as in the wrist of arcs: points at the
chords' middles, and the hand.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled, implements, kernel
from wristctl.lanes.functions import bessel
from wristctl.lanes.lane import planar, turn, zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, planes_like, rows_of, square_like
from wristctl.wrist.arcs import Chords
from wristctl.wrist.chain import (
    bend_along,
    chords,
    disturbed_chain,
    lengths,
    moment_arms,
    spring,
    tendon_torques,
)
from wristctl.wrist.dynamics import bias
from wristctl.wrist.integrator import step
from wristctl.wrist.jacobian import residual_jacobians
from wristctl.wrist.kinematics import Planar
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.statics import settled
from wristctl.wrist.tendon_mechanics import travel
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Angle of a hinge [rad] at which a part lies on the one before it.
FOLDED = math.pi


class Hinges(NamedTuple):
    """Parameters of a wrist of n parts with a hinge each; SI units."""

    length: Any
    mass: Any
    hand_mass: Any
    hand_offset: Any
    gravity_x: Any
    gravity_y: Any
    tendon_offset: Any
    stiffness: Any
    """Stiffness of the hinge nearest to the base."""
    damping: Any
    force_x: Any
    force_y: Any
    softening: Any
    """Stiffness of each hinge over that of the one before it."""


_read = tuple_of(Hinges)


@compiled
def _turned(q: Any) -> Any:
    e0, e1, _, _ = bessel(q)
    return planar(e0 - q * q * e1, q * e0)  # (cos q, sin q)


@implements(chords, Hinges)
@compiled
def _chords(segment: Any, theta: Any, arc: Any) -> Any:
    tangent, half = planar(1.0 + zero_like(segment.length), 0.0), 0.5 * segment.length
    for k in range(len(theta)):
        after = tangent * _turned(theta[k])
        link = half * after
        arc.z[k] = half * tangent + link
        arc.dz[k] = turn(link)
        arc.d2z[k] = -1.0 * link
        arc.d3z[k] = -1.0 * turn(link)
        tangent = after
    return tangent


@compiled
def _half(theta: Any) -> Any:
    y = 0.5 * theta
    e0, e1, _, _ = bessel(y)
    return e0 - y * y * e1, y * e0  # cos(q/2), sin(q/2)


@implements(lengths, Hinges)
@compiled
def _lengths(segment: Any, theta: Any) -> Any:
    cosine, sine = _half(theta)
    bending, middle = 2.0 * segment.tendon_offset * sine, segment.length * cosine
    return middle - bending, middle + bending


@implements(moment_arms, Hinges)
@compiled
def _moment_arms(segment: Any, theta: Any) -> Any:
    cosine, sine = _half(theta)
    bending, compression = segment.tendon_offset * cosine, 0.5 * segment.length * sine
    return bending + compression, compression - bending


@implements(tendon_torques, Hinges)
@compiled
def _tendon_torques(segment: Any, theta: Any, plus: Any, minus: Any, torque: Any, slope: Any) -> None:
    bend, squeeze = segment.tendon_offset * (plus - minus), 0.5 * segment.length * (plus + minus)
    for k in range(len(theta)):
        cosine, sine = _half(theta[k])
        torque[k] = bend * cosine + squeeze * sine
        slope[k] = 0.5 * (squeeze * cosine - bend * sine)


@implements(spring, Hinges)
@compiled
def _spring(segment: Any, k: int) -> Any:
    stiffness = segment.stiffness
    for _ in range(k):
        stiffness = stiffness * segment.softening
    return stiffness


@compiled
def _within(plant: Any, q: Any) -> Any:
    inside = abs(q[0]) < FOLDED
    for k in range(1, len(q)):
        inside = inside & (abs(q[k]) < FOLDED)
    return inside


def tapered(wrist: WristParameters, n: int) -> tuple[float, float]:
    """Stiffness of each of n hinges over that of the one before it, and of the first over that of n equal ones.

    Of springs in series the taper leaves the whole as soft as it is; from the base to the tip the stiffness falls
    (taper > 1) by the same factor from hinge to hinge.
    """
    softening = wrist.taper ** (-1.0 / max(n - 1, 1))
    return softening, float(np.mean(softening ** -np.arange(n, dtype=float)))


def values(wrist: WristParameters, n: int) -> Array:
    """The wrist cut into n equal parts, with springs in series."""
    named = dict(zip(Segments._fields, segments(wrist, n).tolist(), strict=True))
    del named["spans"]
    softening, first = tapered(wrist, n)
    named["stiffness"] *= first
    return np.array(Hinges(**named, softening=softening))


def _links(wrist: WristParameters, q: Array) -> tuple[float, Array]:
    """Half a part's length [m], and the direction of the base's half and of each hinge's further half, (..., n + 1)."""
    before = np.zeros((*q.shape[:-1], 1))
    return 0.5 * wrist.length / q.shape[-1], np.exp(1j * np.concatenate([before, np.cumsum(q, axis=-1)], axis=-1))


def _tips(wrist: WristParameters, q: Array) -> Array:
    half, along = _links(wrist, q)
    tip = half * (along[..., :-1] + along[..., 1:]).sum(axis=-1)
    return np.stack([tip.real, tip.imag], axis=-1)


def _taut(wrist: WristParameters, q: Array) -> Array:
    middle = wrist.length / len(q) * np.cos(0.5 * q)
    bending = 2.0 * wrist.tendon_offset * np.sin(0.5 * q)
    return np.array([(middle - bending).sum(), (middle + bending).sum()])


def _backbone(wrist: WristParameters, q: Array, places: Array) -> tuple[Planar, Planar]:
    half, along = _links(wrist, q)
    ends = np.array([0.0, *(half * np.arange(1, 2 * len(q), 2)), wrist.length])
    passed = np.clip(places[:, None] - ends[:-1], 0.0, np.diff(ends))
    straight = np.maximum((passed > 0.0).sum(axis=1) - 1, 0)
    return (passed * along).sum(axis=1), along[straight]


@kernel
def _balance(parameters: Any, state: Any, out: Any, cut: Any) -> None:
    plant, result, n = _read(rows_of(parameters)), rows_of(out), len(cut)
    rows = rows_of(state)
    q, still, pulls = part(rows, 0, cut), part(rows, n, cut), beyond(rows, 2 * n)
    arc = Chords(planes_like(q), planes_like(q), planes_like(q), planes_like(q))
    by_q, by_rate = square_like(q), square_like(q)
    r, pull, slope = lanes_like(q), lanes_like(q), lanes_like(q)
    tangent = _chords(plant, q, arc)
    _tendon_torques(plant, q, pulls[0], pulls[1], pull, slope)
    bias(plant, q, still, arc, tangent, pull, r)
    residual_jacobians(plant, still, still, arc, tangent, slope, by_q, by_rate)
    for i in range(n):
        result[i] = r[i]
        for j in range(n):
            result[n + n * i + j] = by_q[i, j]


def equilibrium(wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
    """Angles of the hinges (n,) [rad] at rest under tensions [N per tendon, + and - side]; UserError if it buckles."""
    parameters, pulls, out = values(wrist, n), TENDONS_PER_SIDE * np.asarray(tensions), np.empty(n + n * n)

    def balance(q: Array) -> tuple[Array, Array]:
        _balance(parameters, np.concatenate([q, np.zeros(n), pulls]), out, (0,) * n)
        return out[:n].copy(), out[n:].reshape(n, n).copy()

    return settled(balance, np.zeros(n), f"{tensions[0]:g} N and {tensions[1]:g} N")


HINGES = PlantModel(
    name="hinges",
    parameters=Hinges,
    coordinates=lambda n: n,
    values=values,
    advance=step,
    bend_of=bend_along,
    travel=travel,
    within=_within,
    disturbed=disturbed_chain,
    angle=lambda q: q.sum(axis=-1),
    tips=_tips,
    taut=_taut,
    backbone=_backbone,
    equilibrium=equilibrium,
)
