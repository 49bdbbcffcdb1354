"""Rigid links in two planes as a plant: between two discs a universal joint, which may be stiffer toward the base.

As `wristctl.wrist.hinges` in the plane: a part of length l goes straight to the joint in its middle and straight on.
The joint bends by a vector u without twist, so that the chord is l/2 (t + t') with the tangents t before it and
t' = cos|u| t + sin|u|/|u| nu after it. A tendon at c runs straight from a disc's hole to the next one's, which are
l cos(|u|/2) - c.u S(|u|/2) apart, S(x) = sin(x)/x. There is a disc at either end of every part.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled, implements, kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import lanes_like, part, rows_of, square_like
from wristctl.wrist.hinges import tapered
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.spatial.pcc_in_space import bend_in_space, load_in_space, within_bends
from wristctl.wrist.spatial.spatial_chain import Chord, chord_of, chord_unit, springs_of
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, spatial_bias
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spatial_kinematics import tip_bends, turned_by
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialSegments, own_values, rows_of_tendons
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spatial_tendons import (
    lengths_along,
    moment_arms_of,
    place_y,
    place_z,
    share_of,
    tendons_torques,
)
from wristctl.wrist.spatial.spooled_tendons import travel_in_space
from wristctl.wrist.spatial.stumpff import slopes, stumpff
from wristctl.wrist.statics import settled
from wristctl.wrist.tendon_layout import TendonLayout


class SpatialHinges(NamedTuple):
    """Parameters of a wrist of n parts with a universal joint each; SI units, axes as of SpatialSegments."""

    length: Any
    mass: Any
    hand_mass: Any
    hand_offset: Any
    stiffness_yy: Any
    """Of the joint nearest to the base."""
    stiffness_yz: Any
    stiffness_zz: Any
    damping_yy: Any
    damping_yz: Any
    damping_zz: Any
    gravity_x: Any
    gravity_y: Any
    gravity_z: Any
    force_x: Any
    force_y: Any
    force_z: Any
    softening: Any
    """Stiffness of each joint over that of the one before it."""


class HingedWrist(NamedTuple):
    """A wrist in compiled code: SpatialHinges, and three rows for each tendon, as SpatialWrist has them."""

    segment: Any
    tendons: Any


_load, _FIELDS = tuple_of(SpatialHinges), len(SpatialHinges._fields)


@compiled
def _wrist(rows: Any, pulls: Any) -> Any:
    return HingedWrist(_load(rows), part(rows, _FIELDS, pulls + pulls + pulls))


def _read(model: Any, rows: Any, pulls: Any = ()) -> Any:
    return _wrist(rows, pulls)


@implements(chord_unit, SpatialHinges)
def _half_a_part(segment: Any) -> Any:
    return 0.5 * segment.length


@implements(chord_of, SpatialHinges)
def _two_halves(segment: Any, c: Any) -> Any:
    d = slopes(c)
    e1, e2, e3 = d.d3 - d.d2, 2.0 * d.d4 - d.d3, 3.0 * d.d5 - d.d4
    return Chord(1.0 + c.c0, c.c1, -c.c1, d.d1, -d.d1, e1, -e1, e3 - e2)


@implements(springs_of, SpatialHinges)
def _softer_outward(segment: Any, k: int) -> Any:
    share = 1.0 + zero_like(segment.softening)
    for _ in range(k):
        share = share * segment.softening
    return share * segment.stiffness_yy, share * segment.stiffness_yz, share * segment.stiffness_zz


class _Span(NamedTuple):
    """What a tendon's length along a part is for each length l of the part and each -c.u; functions of |u|^2.

    A fall is minus the derivative by a component u_i over that u_i, the second one that one's again.
    """

    along: Any
    lean: Any
    along_1: Any
    lean_1: Any
    along_2: Any
    lean_2: Any


@compiled
def _span(y: Any, z: Any) -> Any:
    c = stumpff(0.25 * (y * y + z * z))
    falling = c.c2 - c.c3
    return _Span(
        c.c0, c.c1, 0.25 * c.c1, 0.25 * falling, 0.0625 * falling, 0.0625 * (c.c3 - 3.0 * c.c4 + 3.0 * c.c5)
    )  # fmt: skip


@implements(lengths_along, HingedWrist)
def _lengths(wrist: Any, q: Any, lengths: Any) -> None:
    segment, tendons = wrist.segment, wrist.tendons
    for t in range(len(lengths)):
        lengths[t] = zero_like(segment.length)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        span = _span(y, z)
        for t in range(len(lengths)):
            across = place_y(tendons, t) * y + place_z(tendons, t) * z
            along = segment.length * span.along - across * span.lean
            lengths[t] = lengths[t] + share_of(tendons, t, k) * along


@implements(moment_arms_of, HingedWrist)
def _moment_arms(wrist: Any, q: Any, t: int, arms: Any) -> None:
    c_y, c_z = place_y(wrist.tendons, t), place_z(wrist.tendons, t)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        share, span = share_of(wrist.tendons, t, k), _span(y, z)
        squeeze = wrist.segment.length * span.along_1 - (c_y * y + c_z * z) * span.lean_1
        arms[2 * k] = share * (c_y * span.lean + squeeze * y)
        arms[2 * k + 1] = share * (c_z * span.lean + squeeze * z)


@implements(tendons_torques, HingedWrist)
def _torques(wrist: Any, q: Any, pulls: Any, torques: Any) -> None:
    segment, tendons = wrist.segment, wrist.tendons
    zero = zero_like(segment.length)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        span, pull, pull_y, pull_z = _span(y, z), zero, zero, zero
        for t in range(len(pulls)):
            along = share_of(tendons, t, k) * pulls[t]
            pull = pull + along
            pull_y = pull_y + along * place_y(tendons, t)
            pull_z = pull_z + along * place_z(tendons, t)
        straight, across = segment.length * pull, pull_y * y + pull_z * z
        squeeze = straight * span.along_1 - across * span.lean_1
        bent = straight * span.along_2 - across * span.lean_2
        torques.torque[2 * k] = span.lean * pull_y + squeeze * y
        torques.torque[2 * k + 1] = span.lean * pull_z + squeeze * z
        torques.slope[2 * k] = squeeze - 2.0 * span.lean_1 * pull_y * y - bent * y * y
        torques.slope[2 * k + 1] = squeeze - 2.0 * span.lean_1 * pull_z * z - bent * z * z
        torques.slope_across[k] = -span.lean_1 * (pull_y * z + pull_z * y) - bent * y * z


def values(wrist: WristParameters, n: int) -> Array:
    """The wrist cut into n equal parts: SpatialHinges, then its tendons; UserError for one that ends within a part."""
    layout = TendonLayout.of(wrist)
    of_arcs = own_values(wrist, n, layout)
    named = dict(zip(SpatialSegments._fields, of_arcs[:FIELDS].tolist(), strict=True))
    del named["spans"]
    softening, first = tapered(wrist, n)
    for name in ("stiffness_yy", "stiffness_yz", "stiffness_zz"):
        named[name] *= first
    hinges = np.array(SpatialHinges(**named, softening=softening))
    return np.concatenate([hinges, rows_of_tendons(layout.cross_section, layout.ends(wrist.discs, n))])


@kernel
def _balance(parameters: Any, state: Any, out: Any, cut: Any, pulls: Any) -> None:
    rows, result, m = rows_of(state), rows_of(out), len(cut)
    wrist = _wrist(rows_of(parameters), pulls)
    q, still = part(rows, 0, cut), part(rows, m, cut)
    r, mass, by_q, by_rate = lanes_like(q), square_like(q), square_like(q), square_like(q)
    bent = bent_wrist(wrist, q, part(rows, 2 * m, pulls), mass)
    spatial_bias(wrist.segment, q, still, bent.posture, bent.tangent, bent.torques.torque, r)
    spatial_jacobians(wrist.segment, q, still, still, bent, by_q, by_rate)
    for i in range(m):
        result[i] = r[i]
        for j in range(m):
            result[m + m * i + j] = by_q[i, j]


def hinged_equilibrium(wrist: WristParameters, n: int, pulls: ArrayLike) -> Array:
    """Bends of the joints (2n,) [rad] at rest under pulls (T,) [N] of all tendons of each place.

    Raises UserError if it buckles.
    """
    parameters, held, m = values(wrist, n), np.asarray(pulls, float), 2 * n
    out = np.empty(m + m * m)

    def balance(q: Array) -> tuple[Array, Array]:
        _balance(parameters, np.concatenate([q, np.zeros(m), held]), out, (0,) * m, (0,) * len(held))
        return out[:m].copy(), out[m:].reshape(m, m).copy()

    return settled(balance, np.zeros(m), f"pulls of {held.max():g} N at most")


def _equilibrium(wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
    return hinged_equilibrium(wrist, n, TendonLayout.of(wrist).multiplicity * tensions[0])


def _links(q: Array) -> Array:
    """Axes of the base's half link and of what is beyond each joint, as columns, (..., n + 1, 3, 3)."""
    bends = q.reshape(*q.shape[:-1], -1, 2)
    axes = [np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))]
    for k in range(bends.shape[-2]):
        axes.append(axes[-1] @ turned_by(bends[..., k, :]))
    return np.stack(axes, axis=-3)


def _tips(wrist: WristParameters, q: Array) -> Array:
    along, half = _links(q)[..., 0], wrist.length / q.shape[-1]
    tip: Array = half * (along[..., :-1, :] + along[..., 1:, :]).sum(axis=-2)
    return tip


def _frames(wrist: WristParameters, q: Array, shares: Array) -> tuple[Array, Array]:
    axes, n = _links(q), len(q) // 2
    ends = np.array([0.0, *((np.arange(n) + 0.5) / n), 1.0])
    passed = np.clip(shares[:, None] - ends[:-1], 0.0, np.diff(ends))
    link = np.maximum((passed > 0.0).sum(axis=1) - 1, 0)
    return wrist.length * passed @ axes[:, :, 0], axes[link]


HINGES_IN_SPACE = PlantModel(
    name="hinges",
    parameters=HingedWrist,
    planes=2,
    coordinates=lambda n: 2 * n,
    values=values,
    advance=spatial_step,
    bend_of=bend_in_space,
    travel=travel_in_space,
    within=within_bends,
    disturbed=load_in_space,
    tips=_tips,
    frames=_frames,
    read=_read,
    angle=tip_bends,
    equilibrium=_equilibrium,
)
