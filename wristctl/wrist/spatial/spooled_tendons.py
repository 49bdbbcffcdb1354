"""Tendons between spools and a wrist in two planes, as the integration step evaluates them; a row for each tendon.

By the type of `tendons` the step's `spool_input` is a pull [N] that is held (NoTendons), or the length [m] that a spool
has reeled in of an elastic tendon (ElasticTendons, RubbingTendons): that pulls stiffness times stretch, and never
pushes. A rubbing tendon pulls less at the wrist than at its spool where it is reeled in, and more where it is paid
out: the capstan's equation with a Dahl bristle, as `wristctl.wrist.tendon_mechanics` has it in one plane.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import sqrt, where, zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.dahl import bristle, bristle_slope
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of, share_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, capstan

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


@implements(pulls_of_tendons, NoTendons)
def _held(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    for t in range(len(pulls)):
        pulls[t] = spool_input[t]


@implements(stiffen_by_tendons, NoTendons)
def _soft(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    pass


@implements(remember_travel, NoTendons, ElasticTendons)
def _nothing(tendons: Any, wrist: Any, q: Any) -> None:
    pass


@implements(pulls_of_tendons, ElasticTendons)
def _stretched(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    lengths_along(wrist, q, pulls)
    for t in range(len(pulls)):
        stretch = spool_input[t] - travel_of(wrist, t, pulls[t])
        pulls[t] = tendons.stiffness[t] * maximum(0.0, stretch)


@implements(pulls_of_tendons, RubbingTendons)
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


@implements(stiffen_by_tendons, ElasticTendons)
def _taut(tendons: Any, wrist: Any, q: Any, rate: Any, pulls: Any, by_q: Any) -> None:
    arms, zero = lanes_like(q), zero_like(wrist.segment.length)
    for t in range(len(pulls)):
        moment_arms_of(wrist, q, t, arms)
        _add_stiffness(where(pulls[t] > 0.0, tendons.stiffness[t], zero), arms, by_q)


@implements(stiffen_by_tendons, RubbingTendons)
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
