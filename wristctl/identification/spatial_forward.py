"""The forward model in two planes: the bend that a wrist takes where its tendons' spools are moved as recorded.

Candidates run side by side, one a lane, on the plant, the tendons and the integrator of the simulation.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.identification.rotor_field import (
    Field,
    Rotors,
    field_of,
    motion_of,
    own_stiffness,
    turn_rotor,
)
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.simulation.nonideal import faults_of, nonideal_of, unmoved
from wristctl.wrist.dahl import NoInnerFriction
from wristctl.wrist.plant import advance_or_stop, kernel_of, parameters_of, path_before
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.posture import tip_bend
from wristctl.wrist.spatial.spatial_segments import FIELDS, OF_A_TENDON, own_values, rows_of_tendons
from wristctl.wrist.spatial.spooled_tendons import RealPlaces, read_faults
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import Nonideal, read_nonideal, shortening, spool_pull

SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest on its first spool positions."""
_NONIDEAL = len(Nonideal._fields)


class SupposedBends(NamedTuple):
    """A wrist in two planes and its tendons as they may be."""

    wrist: WristParameters
    tendons: Actuator
    places: Array
    """Places of the tendons in the cross-section (M, 2) [m], toward ulnar and toward flexion."""
    taut: tuple[float, ...]
    """Length that each tendon has reeled in beyond its spool's count [m]."""
    shares: Array
    """Share of the wrist's length that the tendons of each place span (M,)."""
    alike: NDArray[np.int64]
    """Number of tendons of each place (M,)."""
    rotors: Rotors = Rotors()
    """The motor of one tendon; where it is known to swing, the stiffness of `tendons` has its field in series."""


class _Shapes(NamedTuple):
    """Tuples with an entry, of no meaning, for each coordinate and each tendon; and how rotors move."""

    cut: Any
    of_pulls: Any
    rotors: Any


def _follow(model: Any, values: Any, state: Any, reeled: Any, h: float, settle: int, out: Any, shapes: Any) -> None:
    rows, states = rows_of(values), rows_of(state)
    m, count = len(shapes.cut), len(shapes.of_pulls)
    wrist, first = parameters_of(model, rows, shapes.of_pulls), FIELDS + OF_A_TENDON * count
    taut, stiffness = part(rows, first, shapes.of_pulls), part(rows, first + count, shapes.of_pulls)
    per_newton, per_mass = (
        part(rows, first + 2 * count, shapes.of_pulls),
        part(rows, first + 3 * count, shapes.of_pulls),
    )
    radian, decay = rows[first + 4 * count], rows[first + 4 * count + 1]
    nonideal = beyond(rows, first + 4 * count + 2)
    tendons = RealPlaces(
        stiffness, read_nonideal(nonideal), read_faults(beyond(nonideal, _NONIDEAL), shapes.of_pulls),
        beyond(states, 2 * (m + count)), NoInnerFriction(), shapes.of_pulls,
    )  # fmt: skip
    q, rate, spools = part(states, 0, shapes.cut), part(states, m, shapes.cut), lanes_like(taut)
    turning, zero = beyond(states, 2 * m), zero_like(taut[0])
    alive = 1.0 + zero
    for t in range(count):
        turning[2 * t] = reeled[0, t] + taut[t]
    for k in range(-settle, reeled.shape[0]):
        now, before = max(k, 0), max(k - 1, 0)
        path = path_before(tendons, wrist, q)
        for t in range(count):
            field = Field(radian, per_newton[t], per_mass[t], decay)
            counted = reeled[before, t] + taut[t], reeled[now, t] + taut[t]
            spools[t] = turn_rotor(shapes.rotors, field, tendons, counted, turning, t, shortening(path, t), h)
        if k >= 0:
            row = rows_of(out[k])
            row[0], row[1], _, _, _ = tip_bend(wrist.segment, q, rate)
            for t in range(count):
                row[2 + t] = spool_pull(tendons, spools[t], t, shortening(path, t))
        alive, _ = advance_or_stop(wrist, q, rate, spools, tendons, h + zero, alive)


def courses_of_bends(candidates: Sequence[SupposedBends], reeled: Array, h: float, n: int) -> Array:
    """Bends [rad] and, of each place, the pull of one tendon at its spool [N] of candidates, at steps of h [s].

    They are (count, T, 2 + M).

    Parameters
    ----------
    candidates : wrists, cut into n segments, with M places of tendons each, the same number of tendons at a place
    reeled : length that each spool has reeled in since its tendon was taut and free of tension on the straight wrist
        (T, M) [m], held over each step; at first the wrist is at rest
    """
    tendons, coordinates, count = reeled.shape[1], 2 * n, len(candidates)
    rotors = motion_of(candidates[0].tendons, candidates[0].rotors, h)
    shapes, follow = _Shapes((0,) * coordinates, (0,) * tendons, rotors), kernel_of(_follow, PCC_IN_SPACE)
    rows = np.array([_values(candidate, n, h) for candidate in candidates])
    blocks = to_blocks(np.repeat(rows, 2, axis=0) if count == 1 else rows)  # one width is compiled
    spools = np.ascontiguousarray(reeled, float)
    out = np.empty((len(blocks), len(spools), 2 + tendons, blocks.shape[2]))
    at_rest = unmoved(np.zeros(tendons), np.zeros(2 * tendons), np.zeros(tendons), np.zeros(coordinates))
    begin = np.append(np.zeros(2 * (coordinates + tendons)), at_rest)
    for values, course in zip(blocks, out, strict=True):
        state = np.repeat(begin[:, None], blocks.shape[2], axis=1)
        follow(PCC_IN_SPACE, values, state, spools, h, round(SETTLE / h), course, shapes)
    flat = to_rows(out.reshape(len(out), -1, blocks.shape[2]), count)
    courses = flat.reshape(count, len(spools), 2 + tendons)
    return np.concatenate([courses[..., :2], courses[..., 2:] / candidates[0].alike], axis=2)


def _values(supposed: SupposedBends, n: int, h: float) -> Array:
    wrist, along = supposed.wrist, n * supposed.shares
    own = own_values(wrist, n, TendonLayout.four(wrist.tendon_radius))
    tendons, facts = supposed.tendons.model_copy(update={"level": "tendon"}), TendonFacts()
    alike = np.asarray(supposed.alike, float)
    stiffness, faults = alike * own_stiffness(tendons, supposed.rotors), faults_of(tendons, facts, alike)
    nonideal, field = nonideal_of(TrueWrist(), tendons, facts, h), field_of(tendons, supposed.rotors)
    return np.concatenate(
        [
            own[:FIELDS], rows_of_tendons(supposed.places, along), supposed.taut, stiffness, field.per_newton / alike,
            field.per_mass / alike, [field.radian, field.decay], nonideal, faults.ravel(),
        ]
    )  # fmt: skip
