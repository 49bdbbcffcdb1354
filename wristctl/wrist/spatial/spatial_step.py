"""One step of RODAS3 (`wristctl.wrist.integrator`) on the wrist in two planes, with the exact Jacobian.

The step's `spool_input` holds a row for each tendon. By the type of `tendons` it is a pull [N] that is held
(NoTendons), or the length [m] that a spool has reeled in of an elastic one (ElasticTendons, with a row of stiffnesses
[N/m] for the tendons): that pulls stiffness times stretch, and never pushes.
"""

from typing import Any

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import sqrt, where, zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.integrator import Held, accelerate, factorise, rodas3, solve
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, spatial_bias, spatial_equation
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons


@by_type
def pulls_of_tendons(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    """Pulls [N] of all tendons at coordinates q, into T rows."""
    raise NotImplementedError("compiled code only")


@by_type
def stiffen_by_tendons(tendons: Any, wrist: Any, q: Any, pulls: Any, by_q: Any) -> None:
    """Add to dr/dq what tendons on held spools add: arm_i k arm_j of each that is taut."""
    raise NotImplementedError("compiled code only")


@implements(pulls_of_tendons, NoTendons)
def _held(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    for t in range(len(pulls)):
        pulls[t] = spool_input[t]


@implements(stiffen_by_tendons, NoTendons)
def _soft(tendons: Any, wrist: Any, q: Any, pulls: Any, by_q: Any) -> None:
    pass


@implements(pulls_of_tendons, ElasticTendons)
def _stretched(tendons: Any, wrist: Any, q: Any, spool_input: Any, pulls: Any) -> None:
    lengths_along(wrist, q, pulls)
    for t in range(len(pulls)):
        straight = wrist.tendons[OF_A_TENDON * t + 2] * wrist.segment.length
        pulls[t] = tendons.stiffness[t] * maximum(0.0, spool_input[t] - (straight - pulls[t]))


@implements(stiffen_by_tendons, ElasticTendons)
def _taut(tendons: Any, wrist: Any, q: Any, pulls: Any, by_q: Any) -> None:
    arms, zero = lanes_like(q), zero_like(wrist.segment.length)
    for t in range(len(pulls)):
        moment_arms_of(wrist, q, t, arms)
        stiffness = where(pulls[t] > 0.0, tendons.stiffness[t], zero)
        for i in range(len(q)):
            scaled = stiffness * arms[i]
            for j in range(len(q)):
                by_q[i, j] = by_q[i, j] + scaled * arms[j]


@compiled
def _accelerations(held: Any, q: Any, rate: Any, mass: Any, a: Any) -> None:
    pulls = lanes_like(held.spool_input)
    pulls_of_tendons(held.tendons, held.plant, q, held.spool_input, pulls)
    spatial_equation(held.plant, q, rate, pulls, mass, a)
    factorise(mass)
    solve(mass, a)


@compiled
def _linearised(held: Any, q: Any, rate: Any, linear: Any) -> None:
    wrist, pulls = held.plant, lanes_like(held.spool_input)
    pulls_of_tendons(held.tendons, wrist, q, held.spool_input, pulls)
    bent = bent_wrist(wrist, q, pulls, linear.mass)
    spatial_bias(wrist.segment, q, rate, bent.posture, bent.tangent, bent.torques.torque, linear.acceleration)
    accelerate(linear.mass, linear.factors, linear.acceleration)
    spatial_jacobians(wrist.segment, q, rate, linear.acceleration, bent, linear.by_q, linear.by_rate)
    stiffen_by_tendons(held.tendons, wrist, q, pulls, linear.by_q)


@compiled
def spatial_step(wrist: Any, q: Any, rate: Any, spool_input: Any, tendons: Any, h: Any) -> Any:
    """Advance coordinates and rates by h [s] with `spool_input` held.

    Returns the size of the bend's and of its rate's [rad, rad/s] difference to the embedded solution of second order,
    summed over the segments, with stiff modes filtered out (as `wristctl.wrist.integrator.step` has it).
    """
    last_q, last_rate = lanes_like(q), lanes_like(q)
    rodas3(_linearised, _accelerations, Held(wrist, spool_input, tendons), q, rate, h, last_q, last_rate)
    hg = 0.5 * h
    return _size(last_q) / hg, _size(last_rate) / hg


@compiled
def _size(pairs: Any) -> Any:
    y, z = pairs[0], pairs[1]
    for k in range(1, len(pairs) // 2):
        y = y + pairs[2 * k]
        z = z + pairs[2 * k + 1]
    return sqrt(y * y + z * z)
