"""One step of RODAS3 (`wristctl.wrist.integrator`) on the wrist in two planes, with the exact Jacobian.

The step's `spool_input` holds a row for each tendon: pulls or reeled lengths, by the type of `tendons`
(`wristctl.wrist.spatial.spooled_tendons`).
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import sqrt
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.integrator import Held, accelerate, factorise, rodas3, solve
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, spatial_bias, spatial_equation
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spooled_tendons import pulls_of_tendons, stiffen_by_tendons


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
    stiffen_by_tendons(held.tendons, wrist, q, rate, pulls, linear.by_q)


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
