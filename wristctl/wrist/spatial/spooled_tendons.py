"""Tendons between spools and a wrist in two planes, as the integration step evaluates them; a row for each place.

What a tendon does is `wristctl.wrist.tendon_mechanics`'s, as in one plane. Each place has a path, stiffness, friction
and faults of its own: its travel along the bent wrist, and the bends of the segments that it runs along, which wrap it.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.lane import sqrt, zero_like
from wristctl.lanes.rows import entries, lanes_like, part, rows_of
from wristctl.lanes.space import first_third
from wristctl.wrist.dahl import inner_in_lanes
from wristctl.wrist.plant import no_path, path_along, path_before, travelled
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of, share_of
from wristctl.wrist.tendon_mechanics import (
    WRAPPED,
    Fault,
    NoTendons,
    X,
    held_pull,
    pull_along,
    pull_at_start,
    pull_slope,
    read_nonideal,
    row_of,
    slid_pull,
    slid_slope,
    stiffness_at,
    stretch_pull,
    stretch_slope,
    stuck_pull,
    tendons_in_lanes,
    update_memory,
    update_nothing,
    update_tendons,
    update_wrist,
)


class PulledPlaces(NamedTuple):
    """Places whose pulls are held, as PulledTendons in one plane, with the Fault of each.

    In one block's arrays `pulls` is a tuple with an entry for each place, and `faults` are rows.
    """

    nonideal: Any
    faults: Any
    state: Any
    inner: Any
    pulls: Any


class ElasticPlaces(NamedTuple):
    """Places of tendons that only stretch: the stiffness of all of each [N/m], T rows.

    In one block's arrays `pulls` is a tuple with an entry for each place.
    """

    stiffness: Any
    pulls: Any


class RealPlaces(NamedTuple):
    """Places of tendons with friction, creep and faults, as RealTendons in one plane: the stiffness of all of each
    [N/m], T rows, as long as they are whole, Nonideal, the Fault of each, their state, inner friction.

    In one block's arrays `pulls` is a tuple with an entry for each place, and `faults` are rows.
    """

    stiffness: Any
    nonideal: Any
    faults: Any
    state: Any
    inner: Any
    pulls: Any


@compiled
def read_faults(rows: Any, pulls: Any) -> Any:
    """Fault with rows for each place, of rows one after the other."""
    count = len(pulls)
    return Fault(
        part(rows, 0, pulls), part(rows, count, pulls), part(rows, 2 * count, pulls), part(rows, 3 * count, pulls)
    )


@implements(tendons_in_lanes, PulledPlaces)
def _pulled_in_lanes(tendons: Any) -> Any:
    return PulledPlaces(
        read_nonideal(rows_of(tendons.nonideal)), read_faults(rows_of(tendons.faults), tendons.pulls),
        rows_of(tendons.state), inner_in_lanes(tendons.inner), tendons.pulls,
    )  # fmt: skip


@implements(tendons_in_lanes, ElasticPlaces)
def _elastic_in_lanes(tendons: Any) -> Any:
    return ElasticPlaces(part(rows_of(tendons.stiffness), 0, tendons.pulls), tendons.pulls)


@implements(tendons_in_lanes, RealPlaces)
def _real_in_lanes(tendons: Any) -> Any:
    return RealPlaces(
        part(rows_of(tendons.stiffness), 0, tendons.pulls), read_nonideal(rows_of(tendons.nonideal)),
        read_faults(rows_of(tendons.faults), tendons.pulls), rows_of(tendons.state), inner_in_lanes(tendons.inner),
        tendons.pulls,
    )  # fmt: skip


implements(pull_along, PulledPlaces)(held_pull)
implements(pull_at_start, PulledPlaces)(held_pull)
implements(pull_along, ElasticPlaces)(stretch_pull)
implements(pull_at_start, ElasticPlaces)(stretch_pull)
implements(pull_along, RealPlaces)(slid_pull)
implements(pull_at_start, RealPlaces)(stuck_pull)
implements(pull_slope, ElasticPlaces)(stretch_slope)
implements(pull_slope, RealPlaces)(slid_slope)
implements(update_memory, PulledPlaces)(update_wrist)
implements(update_memory, ElasticPlaces)(update_nothing)
implements(update_memory, RealPlaces)(update_tendons)
implements(path_before, PulledPlaces)(no_path)
implements(path_along, PulledPlaces)(no_path)
implements(path_before, ElasticPlaces)(travelled)
implements(path_along, ElasticPlaces, RealPlaces)(travelled)


@implements(stiffness_at, ElasticPlaces, RealPlaces)
def _stiffness_of_each(tendons: Any, t: int) -> Any:
    return tendons.stiffness[t]


@implements(path_before, RealPlaces)
def _remembered_paths(tendons: Any, plant: Any, q: Any) -> Any:
    travel, wrapped = lanes_like(tendons.stiffness), lanes_like(tendons.stiffness)
    for t in range(len(travel)):
        travel[t] = tendons.state[row_of(t, X)]
        wrapped[t] = tendons.state[row_of(t, WRAPPED)]
    return entries(travel) + entries(wrapped)


@compiled
def straight_length(wrist: Any, t: int) -> Any:
    """Length of a tendon along the straight wrist [m]."""
    return wrist.tendons[OF_A_TENDON * t + 2] * wrist.segment.length


@compiled
def _wrapping(wrist: Any, q: Any, t: int) -> Any:
    """Bend of the segments that a tendon runs along [rad], summed."""
    angle = zero_like(wrist.segment.length)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        angle = angle + share_of(wrist.tendons, t, k) * sqrt(y * y + z * z)
    return angle


@compiled
def travel_in_space(wrist: Any, q: Any) -> Any:
    """`wristctl.wrist.plant.travel` of a SpatialWrist."""
    travel, wrapped = lanes_like(first_third(wrist.tendons)), lanes_like(first_third(wrist.tendons))
    lengths_along(wrist, q, travel)
    for t in range(len(travel)):
        travel[t] = straight_length(wrist, t) - travel[t]
        wrapped[t] = _wrapping(wrist, q, t)
    return entries(travel) + entries(wrapped)


@by_type
def stiffen_by_tendons(tendons: Any, wrist: Any, q: Any, rate: Any, spool_input: Any, path: Any, by_q: Any) -> None:
    """Add to dr/dq what tendons on held spools add: arm_i (-dT/dx) arm_j of each, x its travel."""
    raise NotImplementedError("compiled code only")


@implements(stiffen_by_tendons, NoTendons, PulledPlaces)
def _soft(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, path: Any, by_q: Any) -> None:
    pass


@implements(stiffen_by_tendons, ElasticPlaces, RealPlaces)
def _stiffen(tendons: Any, wrist: Any, q: Any, rate: Any, reeled: Any, path: Any, by_q: Any) -> None:
    arms, zero = lanes_like(q), zero_like(wrist.segment.length)
    for t in range(len(reeled)):
        moment_arms_of(wrist, q, t, arms)
        speed = zero
        for i in range(len(q)):
            speed = speed + arms[i] * rate[i]
        stiffness = pull_slope(tendons, reeled[t], t, path, speed)
        for i in range(len(q)):
            scaled = stiffness * arms[i]
            for j in range(len(q)):
                by_q[i, j] = by_q[i, j] + scaled * arms[j]
