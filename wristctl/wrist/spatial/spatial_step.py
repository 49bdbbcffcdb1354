"""One step of RODAS3 (`wristctl.wrist.integrator`) on the wrist in two planes, with the exact Jacobian.

The step's `spool_input` holds a row for each tendon: pulls or reeled lengths, by the type of `tendons`
(`wristctl.wrist.tendon_mechanics`).
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import sqrt
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.integrator import Held, accelerate, factorise, rodas3, solve
from wristctl.wrist.plant import path_along, path_before
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, spatial_bias, spatial_equation
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spatial_resistance import yield_in_space, yield_jacobians_in_space
from wristctl.wrist.spatial.spooled_tendons import stiffen_by_tendons
from wristctl.wrist.tendon_mechanics import acting_pulls, pull_along


@compiled
def _accelerations(held: Any, q: Any, rate: Any, mass: Any, a: Any) -> None:
    tendons, pulls = held.tendons, lanes_like(held.spool_input)
    path = path_along(tendons, held.plant, q)
    for t in range(len(pulls)):
        pulls[t] = pull_along(tendons, held.spool_input, t, path)
    spatial_equation(held.plant, q, rate, pulls, mass, a)
    yield_in_space(tendons, held.plant, q, rate, held.spool_input, a)
    factorise(mass)
    solve(mass, a)


@compiled
def _linearised(held: Any, q: Any, rate: Any, linear: Any) -> None:
    wrist, tendons, pulls = held.plant, held.tendons, lanes_like(held.spool_input)
    path = path_before(tendons, wrist, q)
    acting_pulls(tendons, held.spool_input, path, pulls)
    bent = bent_wrist(wrist, q, pulls, linear.mass)
    spatial_bias(wrist.segment, q, rate, bent.posture, bent.tangent, bent.torques.torque, linear.acceleration)
    yield_in_space(tendons, wrist, q, rate, held.spool_input, linear.acceleration)
    accelerate(linear.mass, linear.factors, linear.acceleration)
    spatial_jacobians(wrist.segment, q, rate, linear.acceleration, bent, linear.by_q, linear.by_rate)
    stiffen_by_tendons(tendons, wrist, q, rate, held.spool_input, path, linear.by_q)
    yield_jacobians_in_space(tendons, q, rate, linear.by_q, linear.by_rate)


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
