"""Paths of the tendons of a wrist in two planes, and what tendons on held spools add to its Jacobian.

What a tendon does is `wristctl.wrist.tendon_mechanics`'s, as in one plane. Each place has a path of its own: its travel
along the bent wrist, and the bends of the segments that it runs along, which wrap it.
"""

from typing import Any

from wristctl.lanes.compiled import by_type, compiled, implements, nothing
from wristctl.lanes.lane import sqrt, zero_like
from wristctl.lanes.rows import entries, lanes_like
from wristctl.lanes.space import first_third
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of, share_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, PulledTendons, RealTendons, pull_slope


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


implements(stiffen_by_tendons, NoTendons, PulledTendons)(nothing)


@implements(stiffen_by_tendons, ElasticTendons, RealTendons)
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
