"""Tendons between spools and a wrist in two planes, as the integration step evaluates them; a row for each tendon.

By the type of `tendons` the step's `spool_input` is a pull [N] that is held (NoTendons, HeldPlaces), or the length [m]
that a spool has reeled in of an elastic tendon: that pulls stiffness times stretch, and never pushes. A rubbing tendon
pulls less at the wrist than at its spool where it is reeled in, and more where it is paid out: the capstan's equation
with a Dahl bristle, as `wristctl.wrist.tendon_mechanics` has it in one plane.

Those of a loop, at places, break at a time, and lag behind their spools within a backlash.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import sqrt, where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.wrist.dahl import bristle, bristle_slope
from wristctl.wrist.plant import acting_pulls, path_along, path_before
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of, share_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, capstan, tendons_in_lanes, update_memory

# Rows of the state of one rubbing tendon: travel before the step [m], and its bristle.
OF_A_STATE = 2


class RubbingTendons(NamedTuple):
    """Elastic tendons with friction; lanes, SI units."""

    stiffness: Any
    """Of each tendon [N/m], T rows."""
    friction: Any
    sheath: Any
    """Angle by which each tendon is wrapped before it reaches the wrist [rad]."""
    slope: Any
    """One over the path in which friction turns round [1/m]."""
    state: Any
    """OF_A_STATE rows for each tendon."""


class HeldPlaces(NamedTuple):
    """Places whose pulls are held, until their tendons break at a time [s].

    `left` are rows to work on. In one block's arrays `pulls` is a tuple with an entry for each place.
    """

    broken_at: Any
    left: Any
    pulls: Any


class ElasticPlaces(NamedTuple):
    """Places of elastic tendons: the stiffness of all of a place [N/m] before they break, as long as they are whole,
    the time at which they break [s], the backlash of all [m], and the length [m] that each has reeled in.

    In one block's arrays `pulls` is a tuple with an entry for each place.
    """

    whole: Any
    broken_at: Any
    backlash: Any
    stiffness: Any
    reeled: Any
    pulls: Any


class RubbingPlaces(NamedTuple):
    """ElasticPlaces with friction, its values and state as those of RubbingTendons, and travels to work on [m].

    In one block's arrays `friction` holds coefficient, sheath and slope.
    """

    whole: Any
    broken_at: Any
    backlash: Any
    stiffness: Any
    reeled: Any
    friction: Any
    sheath: Any
    slope: Any
    state: Any
    travel: Any
    pulls: Any


@implements(tendons_in_lanes, HeldPlaces)
def _held_in_lanes(tendons: Any) -> Any:
    pulls = tendons.pulls
    return HeldPlaces(part(rows_of(tendons.broken_at), 0, pulls), part(rows_of(tendons.left), 0, pulls), pulls)


@implements(tendons_in_lanes, ElasticPlaces)
def _elastic_in_lanes(tendons: Any) -> Any:
    pulls = tendons.pulls
    return ElasticPlaces(
        part(rows_of(tendons.whole), 0, pulls), part(rows_of(tendons.broken_at), 0, pulls),
        rows_of(tendons.backlash)[0], part(rows_of(tendons.stiffness), 0, pulls),
        part(rows_of(tendons.reeled), 0, pulls), pulls,
    )  # fmt: skip


@implements(tendons_in_lanes, RubbingPlaces)
def _rubbing_in_lanes(tendons: Any) -> Any:
    pulls, values = tendons.pulls, rows_of(tendons.friction)
    return RubbingPlaces(
        part(rows_of(tendons.whole), 0, pulls), part(rows_of(tendons.broken_at), 0, pulls),
        rows_of(tendons.backlash)[0], part(rows_of(tendons.stiffness), 0, pulls),
        part(rows_of(tendons.reeled), 0, pulls), values[0], values[1], values[2], rows_of(tendons.state),
        part(rows_of(tendons.travel), 0, pulls), pulls,
    )  # fmt: skip


@implements(path_before, HeldPlaces, ElasticPlaces, RubbingPlaces)
@implements(path_along, HeldPlaces, ElasticPlaces)
def _nothing_kept(tendons: Any, plant: Any, q: Any) -> Any:
    return tendons.pulls


@implements(path_along, RubbingPlaces)
def _travels(tendons: Any, plant: Any, q: Any) -> Any:
    travel = tendons.travel
    lengths_along(plant, q, travel)
    for t in range(len(travel)):
        travel[t] = travel_of(plant, t, travel[t])
    return tendons.pulls


@implements(update_memory, HeldPlaces, ElasticPlaces)
def _remember_nothing(tendons: Any, q: Any, spool_input: Any, path: Any) -> None:
    pass


@implements(update_memory, RubbingPlaces)
def _remember_travels(tendons: Any, q: Any, spool_input: Any, path: Any) -> None:
    state, travel = tendons.state, tendons.travel
    for t in range(len(travel)):
        state[OF_A_STATE * t + 1] = _slid(tendons, t, travel[t])
        state[OF_A_STATE * t] = travel[t]


@implements(acting_pulls, HeldPlaces, ElasticPlaces, RubbingPlaces)
def _acting(tendons: Any, plant: Any, q: Any, spool_input: Any, path: Any, acts: Any) -> None:
    pulls_of_tendons(tendons, plant, q, spool_input, acts)


@compiled
def straight_length(wrist: Any, t: int) -> Any:
    """Length of a tendon along the straight wrist [m]."""
    return wrist.tendons[OF_A_TENDON * t + 2] * wrist.segment.length


@compiled
def travel_of(wrist: Any, t: int, length: Any) -> Any:
    """By how much a tendon's path is shorter than on the straight wrist [m], of its length [m]."""
    return straight_length(wrist, t) - length


@compiled
def _wrapped(tendons: Any, wrist: Any, q: Any, t: int) -> Any:
    """Coefficient of friction times the angle by which a tendon is wrapped."""
    angle = tendons.sheath
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        angle = angle + share_of(wrist.tendons, t, k) * sqrt(y * y + z * z)
    return tendons.friction * angle


@compiled
def _slid(tendons: Any, t: int, travel: Any) -> Any:
    state = tendons.state
    return bristle(state[OF_A_STATE * t + 1], travel - state[OF_A_STATE * t], tendons.slope)


@by_type
def pulls_of_tendons(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    """Pulls [N] of all tendons on the wrist at coordinates q, into T rows."""
    raise NotImplementedError("compiled code only")


@by_type
def stiffen_by_tendons(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    """Add to dr/dq what tendons on held spools add: arm_i (-dT/dx) arm_j of each, x its travel."""
    raise NotImplementedError("compiled code only")


@by_type
def remember_travel(tendons: Any, wrist: Any, q: Any) -> None:
    """Take the tendons' state over to the end of a step, at coordinates q."""
    raise NotImplementedError("compiled code only")


@implements(pulls_of_tendons, NoTendons, HeldPlaces)
def _held(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    for t in range(len(pulls)):
        pulls[t] = spool_input[t]


@implements(stiffen_by_tendons, NoTendons, HeldPlaces)
def _soft(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    pass


@implements(remember_travel, NoTendons, ElasticTendons)
def _nothing(tendons: Any, wrist: Any, q: Any) -> None:
    pass


@implements(pulls_of_tendons, ElasticTendons, ElasticPlaces)
def _stretched(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    lengths_along(wrist, q, pulls)
    for t in range(len(pulls)):
        stretch = spool_input[t] - travel_of(wrist, t, pulls[t])
        pulls[t] = tendons.stiffness[t] * maximum(0.0, stretch)


@implements(pulls_of_tendons, RubbingTendons, RubbingPlaces)
def _rubbed(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    lengths_along(wrist, q, pulls)
    for t in range(len(pulls)):
        travel = travel_of(wrist, t, pulls[t])
        left = capstan(_wrapped(tendons, wrist, q, t), 1.0, _slid(tendons, t, travel))
        pulls[t] = tendons.stiffness[t] * maximum(0.0, spool_input[t] - travel) * left


@compiled
def _add_stiffness(stiffness: Any, arms: Any, by_q: Any) -> None:
    for i in range(len(arms)):
        scaled = stiffness * arms[i]
        for j in range(len(arms)):
            by_q[i, j] = by_q[i, j] + scaled * arms[j]


@implements(stiffen_by_tendons, ElasticTendons, ElasticPlaces)
def _taut(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    arms, zero = lanes_like(q), zero_like(wrist.segment.length)
    for t in range(len(pulls)):
        moment_arms_of(wrist, q, t, arms)
        _add_stiffness(where(pulls[t] > 0.0, tendons.stiffness[t], zero), arms, by_q)


@implements(stiffen_by_tendons, RubbingTendons, RubbingPlaces)
def _taut_and_rubbing(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    arms, zero = lanes_like(q), zero_like(wrist.segment.length)
    for t in range(len(pulls)):
        moment_arms_of(wrist, q, t, arms)
        speed = zero
        for i in range(len(q)):
            speed = speed + arms[i] * rate[i]
        z, wrapped = tendons.state[OF_A_STATE * t + 1], _wrapped(tendons, wrist, q, t)
        taut = where(pulls[t] > 0.0, tendons.stiffness[t], zero) * capstan(wrapped, 1.0, z)
        _add_stiffness(taut + pulls[t] * wrapped * bristle_slope(z, speed, tendons.slope), arms, by_q)


@implements(remember_travel, RubbingTendons)
def _remember(tendons: Any, wrist: Any, q: Any) -> None:
    state = tendons.state
    count = len(wrist.tendons) // OF_A_TENDON
    lengths = lanes_like(tendons.stiffness)
    lengths_along(wrist, q, lengths)
    for t in range(count):
        travel = travel_of(wrist, t, lengths[t])
        state[OF_A_STATE * t + 1] = _slid(tendons, t, travel)
        state[OF_A_STATE * t] = travel
