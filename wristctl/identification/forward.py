"""The forward model: the angle that a wrist on elastic tendons takes where its spools are moved as recorded.

Candidates run side by side, one a lane: a Jacobian costs a block or two. Actuator and integrator are the simulation's.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.identification.rotor_field import (
    Rotors,
    field_of,
    motion_of,
    own_stiffness,
    read_field,
    turn_rotor,
)
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import by_type, implements
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.simulation.nonideal import inner_of, nonideal_of, place_after_slip, unmoved, wears
from wristctl.wrist.dahl import inner_in_lanes, one_block
from wristctl.wrist.directions import ACTIVE, away_of, in_plane, tendons_of
from wristctl.wrist.out_of_plane import IN_PLANE, Across, across_of, advance_across
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import PlantModel, advance_or_stop, bend_of, kernel_of, parameters_of, travel
from wristctl.wrist.tendon_mechanics import Nonideal, RealTendons, read_nonideal, shortening, spool_pull

_STIFFNESS, _FIELD = len(Nonideal._fields), 8 + len(Across._fields)
"""Row of a tendon's stiffness, before those of each tendon; and of their field, after what the wrist does across."""

_COLUMNS = (0, 2, 1, 3)
"""Columns of lengths (T, 4) by the tendons' order: one of each side, then the others."""
_SPOOLS = (0, 0, 0, 0)
"""Tuple with an entry, of no meaning, for each spool."""

SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest on its first spool positions; on elastic tendons it is fast."""


class SupposedWrist(NamedTuple):
    """A wrist and its tendons as they may be, and what else they may do.

    `taut` is what each tendon has reeled in more [m] than its spool's count says: two of the + side, two of the -. A
    wrist bends `across` the plane too, whose levers are in this order; None: it stays in the plane.
    Where `rotors` are known to swing, the stiffness of `tendons` has their field in series with them.
    """

    wrist: WristParameters
    tendons: Actuator
    taut: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    plant: TrueWrist = TrueWrist()
    facts: TendonFacts = TendonFacts()
    rotors: Rotors = Rotors()
    across: Across | None = None


class Reeled(NamedTuple):
    """Tendon lengths reeled in by the spools (T, 4) [m], held over each step of h [s].

    A wrist has `settle` steps to settle on the first lengths; `faults` are Faultless or Faulty, `rotors` Standing or
    Swinging.
    """

    lengths: Any
    h: float
    settle: int
    faults: Any
    rotors: Any


class Faultless(NamedTuple):
    """No tendon slips, breaks or has backlash."""


class Faulty(NamedTuple):
    """Some tendons may slip, break or have backlash."""


@by_type
def _after_slip(faults: Any, tendons: Any, plant: Any, q: Any, on_spools: Any, time: Any) -> Any:
    """Lengths [m] that four tendons have reeled in of those on their spools."""
    raise NotImplementedError("compiled code only")


@implements(_after_slip, Faultless)
def _all(faults: Any, tendons: Any, plant: Any, q: Any, on_spools: Any, time: Any) -> Any:
    return on_spools


@implements(_after_slip, Faulty)
def _less(faults: Any, tendons: Any, plant: Any, q: Any, on_spools: Any, time: Any) -> Any:
    path, zero, lengths = travel(plant, q), zero_like(time), lanes_like(on_spools)
    for t in range(len(lengths)):
        lengths[t] = place_after_slip(tendons, t, on_spools[t], zero, time, shortening(path, t))
    return lengths


def _advance(
    model: Any, values: Any, friction: Any, spools: Any, memories: Any, state: Any, angle: Any, cut: Any
) -> None:
    (tendon, inner), (memory, others) = friction, memories
    plant, tendon_rows = parameters_of(model, rows_of(values)), rows_of(tendon)
    zero = zero_like(tendon_rows[0])
    tendons = RealTendons(tendon_rows[_STIFFNESS], read_nonideal(tendon_rows), rows_of(memory), inner_in_lanes(inner))
    n = len(cut)
    q, rate = part(rows_of(state), 0, cut), part(rows_of(state), n, cut)
    bend, speed = lanes_like(part(q, 0, (0,))), lanes_like(part(q, 0, (0,)))
    alive = 1.0 + zero
    reeled, rest = spools.lengths, beyond(tendon_rows, _STIFFNESS + 1)
    taut, levers = part(rest, 0, _SPOOLS), part(rest, 4, _SPOOLS)
    bent, turning = rows_of(others), beyond(rows_of(others), 3)
    across, field = read_across(beyond(rest, 8)), read_field(beyond(rest, _FIELD))
    on_spools, pulls = lanes_like(taut), lanes_like(taut)
    for t in range(len(_SPOOLS)):
        turning[2 * t] = reeled[0, _COLUMNS[t]] + taut[t]
    for k in range(-spools.settle, reeled.shape[0]):
        now, before = max(k, 0), max(k - 1, 0)
        if k >= 0:
            bend_of(plant, q, rate, bend, speed)
            rows_of(angle)[k] = bend[0]
        path = travel(plant, q)
        for t in range(len(_SPOOLS)):
            counted = reeled[before, _COLUMNS[t]] + taut[t], reeled[now, _COLUMNS[t]] + taut[t]
            aside, x = levers[t] * bent[0], shortening(path, t)
            on_spools[t] = turn_rotor(spools.rotors, field, tendons, counted, turning, t, x + aside, spools.h) - aside
            pulls[t] = spool_pull(tendons, on_spools[t], t, x)
        advance_across(bent, pulls, levers, across, (zero, zero), tendons.stiffness, spools.h)
        lengths = _after_slip(spools.faults, tendons, plant, q, on_spools, k * spools.h + zero)
        alive, _ = advance_or_stop(plant, q, rate, lengths, tendons, spools.h + zero, alive)


def across_plane(wrist: WristParameters, plane: str, stiffness: float, flexion_ratio: float) -> Across:
    """What a wrist that is seen in a bending plane does across it; its springs' stiffness [N m/rad] is toward ulnar."""
    toward = stiffness * (flexion_ratio if plane == "ulnar" else 1.0)
    beside = in_plane(wrist, "flexion").model_copy(update={"stiffness": toward})
    away = dict(zip(ACTIVE, away_of(plane, "right"), strict=True))
    return across_of(beside, tuple(away.values()))._replace(
        levers=wrist.tendon_offset * np.array([away[tendon] for tendon in tendons_of(plane)], float)
    )


# The constants of one block's lanes.
read_across = tuple_of(Across)


def _across_values(across: Across) -> tuple[float, ...]:
    """Levers by the tendons' order, then the other constants, in whose place of levers nothing is."""
    *constants, levers = across
    return (*levers[list(_COLUMNS)], *constants, 0.0)


def angles(candidates: Sequence[SupposedWrist], reeled: Array, h: float, n: int, model: PlantModel = PCC) -> Array:
    """Bending angles (count, T) [rad] of the candidates, plants of this model cut into n segments, at steps of h [s].

    `reeled` (T, 4) [m] is what the spools have reeled in since the straight wrist's tendons were taut and free of
    tension, held over each step: two tendons of the + side, then the two of the - side. At first the wrist is at rest.
    A candidate that bends a segment beyond a full turn stays where it was.
    """
    values = to_blocks(np.array([model.values(candidate.wrist, n) for candidate in candidates]))
    nonideal = [
        nonideal_of(candidate.plant, candidate.tendons, candidate.facts, h, alike=1) for candidate in candidates
    ]
    faults = Faulty() if any(map(wears, nonideal)) else Faultless()
    tendon_values = [
        (
            *new,
            own_stiffness(old.tendons, old.rotors),
            *np.take(old.taut, _COLUMNS),
            *_across_values(old.across or IN_PLANE),
            *field_of(old.tendons, old.rotors),
        )
        for new, old in zip(nonideal, candidates, strict=True)
    ]
    tendons, k = to_blocks(np.array(tendon_values)), model.coordinates(n)
    trajectories = np.empty((len(values), len(reeled), *values.shape[2:]))
    rotors = motion_of(candidates[0].tendons, candidates[0].rotors, h)
    spools = Reeled(np.ascontiguousarray(reeled, float), h, round(SETTLE / h), faults, rotors)
    advance, rest = kernel_of(_advance, model), unmoved(np.zeros(4), np.zeros(3), np.zeros(4), np.zeros(k))
    friction = inner_of(
        [c.plant for c in candidates], np.zeros((len(candidates), k)), np.zeros(len(candidates)), to_blocks
    )
    for block, (value, tendon, angle) in enumerate(zip(values, tendons, trajectories, strict=True)):
        wide = angle.shape[1:]
        memory = np.ascontiguousarray(np.broadcast_to(rest.reshape(-1, *[1] * len(wide)), (len(rest), *wide)))
        advance(
            model,
            value,
            (tendon, one_block(friction, block)),
            spools,
            (memory, np.zeros((3 + 2 * len(_SPOOLS), *wide))),
            np.zeros((2 * k, *wide)),
            angle,
            (0,) * k,
        )
    return to_rows(trajectories, len(candidates))
