"""The forward model: what a wrist on elastic tendons does where its spools are moved, or pulls kept, as recorded.

Candidates run side by side, one a lane: a Jacobian costs a block or two. Plants, tendons and integrator are the
simulation's; a wrist whose tendons have places bends in two planes.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.identification.rotor_field import (
    Field,
    Rotors,
    Winches,
    field_of,
    motion_of,
    own_stiffness,
    turn_rotor,
)
from wristctl.lanes.blocks import one_block, to_blocks, to_rows
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.simulation.nonideal import (
    faults_of,
    faults_of_sides,
    inner_of,
    nonideal_of,
    place_after_slip,
    unmoved,
    wears,
)
from wristctl.wrist.directions import ACTIVE, away_of, in_plane, tendons_of
from wristctl.wrist.out_of_plane import IN_PLANE, Across, across_of, advance_across
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import PlantModel, advance_or_stop, bend_of, kernel_of, parameters_of, path_before
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_segments import FIELDS, own_values, rows_of_tendons
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import (
    Nonideal,
    RealTendons,
    shortening,
    spool_pull,
    tendons_in_lanes,
)

SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest on its first spool positions; on elastic tendons it is fast."""

# Tendons of one plane by the model's order: one of each side, then the others.
_SIDES = [0, 2, 1, 3]


class Places(NamedTuple):
    """Places of M tendons of a wrist in two planes."""

    cross_section: Array
    """(M, 2) [m], toward ulnar and toward flexion."""
    shares: Array
    """Share of the wrist's length that the tendons of each place span (M,)."""
    alike: NDArray[np.int64]
    """Number of tendons of each place (M,)."""

    @classmethod
    def of(cls, layout: TendonLayout, discs: int) -> Self:
        """Those of a layout in a wrist with so many discs."""
        return cls(layout.cross_section, layout.shares(discs), layout.multiplicity)


class Supposed(NamedTuple):
    """A wrist and its tendons as they may be, and what else they may do.

    Where `rotors` are known to swing, the stiffness of `tendons` has their field in series with them.
    """

    wrist: WristParameters
    tendons: Actuator
    taut: tuple[float, ...] = ()
    """What each tendon has reeled in more than its spool's count says [m]; nothing where none is given."""
    places: Places | None = None
    """None: two tendons of the + side, then two of the -, which bend the wrist in one plane."""
    plant: TrueWrist = TrueWrist()
    facts: TendonFacts = TendonFacts()
    rotors: Rotors = Rotors()
    """The motor of one tendon."""
    across: Across | None = None
    """What a wrist in one plane does across it, levers by the tendons' order; None: it stays in the plane."""
    pulls: tuple[float, ...] = ()
    """Where a log has pulls in place of lengths, each tendon's [N] for one in its column."""


class _Lanes(NamedTuple):
    """Candidates of one block: arrays of rows."""

    wrist: Any
    tendons: Any
    spools: Any
    """Of each tendon what it has reeled in more [m], its lever across [m], `per_newton` and `per_mass` of its field;
    then `radian` and `decay` of all fields, and Across."""
    state: Any
    """Coordinates and rates, place and speed of each rotor, what the wrist does across."""


class _Reeled(NamedTuple):
    """Lengths on the spools (T, M) [m], or what stands for pulls, held over each step of h [s], after `settle` steps on
    the first ones."""

    lengths: Any
    h: float
    settle: int
    rotors: Any
    """Standing, Swinging or Winches."""


class _Shapes(NamedTuple):
    """Tuples with an entry, of no meaning, for each coordinate, plane, tendon, pull and rate that is wanted, and tendon
    that may slip, break or have backlash."""

    cut: Any
    bends: Any
    tendons: Any
    pulls: Any
    rates: Any
    worn: Any


def _follow(model: Any, lanes: Any, reeled: Any, shapes: Any, out: Any) -> None:
    n, count, planes = len(shapes.cut), len(shapes.tendons), len(shapes.bends)
    own, state, h = rows_of(lanes.spools), rows_of(lanes.state), reeled.h
    wrist, tendons = parameters_of(model, rows_of(lanes.wrist), shapes.tendons), tendons_in_lanes(lanes.tendons)
    q, rate = part(state, 0, shapes.cut), part(state, n, shapes.cut)
    turning, bent = beyond(state, 2 * n), beyond(state, 2 * n + 2 * count)
    taut, levers = part(own, 0, shapes.tendons), part(own, count, shapes.tendons)
    per_newton, per_mass = part(own, 2 * count, shapes.tendons), part(own, 3 * count, shapes.tendons)
    radian, decay, across = own[4 * count], own[4 * count + 1], read_across(beyond(own, 4 * count + 2))
    bend, speed = lanes_like(part(q, 0, shapes.bends)), lanes_like(part(q, 0, shapes.bends))
    on_spools, pulls = lanes_like(taut), lanes_like(taut)
    zero = zero_like(radian)
    alive = 1.0 + zero
    for t in range(count):
        turning[2 * t] = reeled.lengths[0, t] + taut[t]
    for k in range(-reeled.settle, reeled.lengths.shape[0]):
        now, before, path = max(k, 0), max(k - 1, 0), path_before(tendons, wrist, q)
        for t in range(count):
            field = Field(radian, per_newton[t], per_mass[t], decay)
            counted = reeled.lengths[before, t] + taut[t], reeled.lengths[now, t] + taut[t]
            aside, x = levers[t] * bent[0], shortening(path, t)
            on_spools[t] = turn_rotor(reeled.rotors, field, tendons, counted, turning, t, x + aside, h) - aside
            pulls[t] = spool_pull(tendons, on_spools[t], t, x)
        if k >= 0:
            row = rows_of(out[k])
            bend_of(wrist, q, rate, bend, speed)
            for p in range(planes):
                row[p] = bend[p]
            for t in range(len(shapes.pulls)):
                row[planes + t] = pulls[t]
            for p in range(len(shapes.rates)):
                row[planes + p] = speed[p]
        if planes == 1:
            advance_across(bent, pulls, levers, across, (zero, zero), tendons.stiffness[0], h)
        for t in range(len(shapes.worn)):
            on_spools[t] = place_after_slip(tendons, t, on_spools[t], zero, k * h + zero, shortening(path, t))
        alive, _ = advance_or_stop(wrist, q, rate, on_spools, tendons, h + zero, alive)


def across_plane(wrist: WristParameters, plane: str, stiffness: float, flexion_ratio: float) -> Across:
    """What a wrist that is seen in a bending plane does across it; its springs' stiffness [N m/rad] is toward ulnar."""
    toward = stiffness * (flexion_ratio if plane == "ulnar" else 1.0)
    beside = in_plane(wrist, "flexion").model_copy(update={"stiffness": toward})
    away = dict(zip(ACTIVE, away_of(plane, "right"), strict=True))
    return across_of(beside, tuple(away.values()))._replace(
        levers=wrist.tendon_offset * np.array([away[tendon] for tendon in tendons_of(plane)], float)
    )


read_across = tuple_of(Across)


def courses(
    candidates: Sequence[Supposed],
    reeled: Array,
    h: float,
    n: int,
    model: PlantModel = PCC,
    pulls: bool = False,
    rates: bool = False,
) -> Array:
    """Bends (count, T, P) [rad] of candidates in P planes at steps of h [s], with M `pulls` or P `rates` as columns.

    A pull is that of one tendon of each place at its spool [N], a rate a bend's [rad/s].

    Parameters
    ----------
    candidates : wrists cut into n segments, at first at rest; one that leaves what its plant can be, as by a segment
        bent beyond a full turn, stays where it was
    reeled : lengths that the spools have reeled in since the straight wrist's tendons were taut and free of tension
        (T, M) [m], held over each step; what stands for their pulls of candidates that have some
    model : plant of a wrist in one plane
    """
    first, tendons, count = candidates[0], reeled.shape[1], len(candidates)
    if first.places is not None:
        model = PCC_IN_SPACE
    order = np.array(_SIDES if first.places is None else range(tendons))
    nonideal = [nonideal_of(each.plant, each.tendons, each.facts, h, alike=1) for each in candidates]
    shapes = _Shapes(
        (0,) * model.coordinates(n), (0,) * model.planes, (0,) * tendons, (0,) * (tendons * pulls),
        (0,) * (model.planes * rates), (0,) * (tendons * any(map(wears, nonideal))),
    )  # fmt: skip
    lanes = _lanes(candidates, nonideal, order, n, model)
    lengths = np.ascontiguousarray(reeled[:, order], float)
    rotors = Winches() if first.pulls else motion_of(first.tendons, first.rotors, h)
    follow, driven = kernel_of(_follow, model), _Reeled(lengths, h, round(SETTLE / h), rotors)
    blocks, wide = len(lanes.wrist), lanes.wrist.shape[2:]
    out = np.empty((blocks, len(reeled), model.planes * (1 + rates) + tendons * pulls, *wide))
    for block, course in enumerate(out):
        follow(model, one_block(lanes, block), driven, shapes, course)
    course = to_rows(out.reshape(blocks, -1, *wide), count).reshape(count, len(reeled), -1)
    if pulls:
        course[..., model.planes :] = course[..., model.planes + np.argsort(order)] / _alike(first, tendons)
    return course


def _alike(supposed: Supposed, tendons: int) -> Array:
    return np.ones(tendons) if supposed.places is None else supposed.places.alike.astype(float)


def _lanes(
    candidates: Sequence[Supposed], nonideal: Sequence[Nonideal], order: NDArray[np.int64], n: int, model: PlantModel
) -> _Lanes:
    tendons, coordinates, count = len(order), model.coordinates(n), len(candidates)
    path = np.zeros(3 if model.planes == 1 else 2 * tendons)
    memory = unmoved(np.zeros(tendons), path, np.zeros(tendons), np.zeros(coordinates))
    rows = []
    for each, imperfect in zip(candidates, nonideal, strict=True):
        alike, field = _alike(each, tendons), field_of(each.tendons, each.rotors)
        *constants, levers = IN_PLANE if each.across is None else each.across
        taut, fields = each.taut or np.zeros(tendons), (each.pulls or field.per_newton / alike, field.per_mass / alike)
        of_each = np.array([taut, np.resize(levers, tendons), *fields])[:, order]
        spools = [*of_each.ravel(), field.radian, field.decay, *constants, 0.0]
        stiffness = alike * own_stiffness(each.tendons, each.rotors)
        faults = (
            faults_of_sides(imperfect, tendons) if model.planes == 1 else faults_of(each.tendons, each.facts, alike)
        )
        rows.append((_values(each, n, model), stiffness, imperfect, faults.ravel(), memory, spools))
    columns = (to_blocks(np.array(column)) for column in zip(*rows, strict=True))
    values, stiffnesses, nonideals, of_faults, memories, of_spools = columns
    at_rest = np.zeros((count, coordinates))
    inner = inner_of([each.plant for each in candidates], at_rest, np.zeros(count), to_blocks, model.planes)
    own = RealTendons(stiffnesses, nonideals, of_faults, memories, inner, (0,) * tendons, (0,) * len(path))
    return _Lanes(values, own, of_spools, np.zeros((len(values), 2 * coordinates + 2 * tendons + 3, *values.shape[2:])))


def _values(supposed: Supposed, n: int, model: PlantModel) -> Array:
    if supposed.places is None:
        return model.values(supposed.wrist, n)
    section, shares, _ = supposed.places
    own = own_values(supposed.wrist, n, TendonLayout.four(supposed.wrist.tendon_radius))
    return np.concatenate([own[:FIELDS], rows_of_tendons(section, n * shares)])
