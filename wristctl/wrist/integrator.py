"""One step of RODAS3 on the wrist, with the exact Jacobian.

RODAS3 (Sandu et al., Atmospheric Environment 31 (1997) 3459): Rosenbrock, four stages, third order, stiffly
accurate, L-stable, so that the fast modes of the light chord masses (1e4-1e5 1/s) need no small step. For a second
order system the 2n equations of each stage reduce to n:

    (M/(h gamma) + dr/d(rate) + h gamma dr/d(theta)) k_rate = M R_rate - h gamma dr/d(theta) R_theta,
    k_theta = h gamma (R_theta + k_rate).
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, planes_like, square_like
from wristctl.wrist.arcs import Chords
from wristctl.wrist.chain import chords, tendon_torques
from wristctl.wrist.dynamics import bias, equation_of_motion, mass_matrix
from wristctl.wrist.elastic import pulls_along, pulls_at_start, stiffen
from wristctl.wrist.jacobian import residual_jacobians
from wristctl.wrist.linear import factorise, solve
from wristctl.wrist.plant import path_along, path_before
from wristctl.wrist.yielding import yield_, yield_jacobians


@compiled
def _stage(mass: Any, by_theta: Any, lu: Any, hg: Any, r_theta: Any, r_rate: Any, k_theta: Any, k_rate: Any) -> None:
    n = len(r_theta)
    for i in range(n):
        total = zero_like(hg)
        for j in range(n):
            total = total + mass[i, j] * r_rate[j] - hg * by_theta[i, j] * r_theta[j]
        k_rate[i] = total
    solve(lu, k_rate)
    for i in range(n):
        k_theta[i] = hg * (r_theta[i] + k_rate[i])


@compiled
def _accelerations(segment: Any, theta: Any, omega: Any, spool_input: Any, tendons: Any, mass: Any, a: Any) -> None:
    """-theta'' into `a`, with `mass` to work on."""
    plus, minus = pulls_along(tendons, spool_input, path_along(tendons, segment, theta))
    equation_of_motion(segment, theta, omega, plus, minus, mass, a)
    yield_(tendons, segment, theta, omega, spool_input, a)
    factorise(mass)
    solve(mass, a)


@compiled
def step(segment: Any, theta: Any, omega: Any, spool_input: Any, tendons: Any, h: Any) -> Any:
    """Advance angles and rates by h [s] with `spool_input` held: pulls [N] of both sides, or what spools reeled in [m].

    Elastic tendons and their friction are evaluated at each stage, and their tangent is in the Jacobian. Returns by how
    much the bend and its rate [rad, rad/s] differ from the embedded solution of second order. That difference is the
    last stage; its share in stiff modes, which die out within the step and say nothing of the error, is filtered out by
    (1 - h gamma J)^-1 (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8).
    """
    n = len(theta)
    hg = 0.5 * h
    per_h, per_hg = 1.0 / h, 2.0 / h
    arc = Chords(planes_like(theta), planes_like(theta), planes_like(theta), planes_like(theta))
    mass, other_mass, lu, by_theta = square_like(theta), square_like(theta), square_like(theta), square_like(theta)
    a0, a, pull, slope = lanes_like(theta), lanes_like(theta), lanes_like(theta), lanes_like(theta)
    k1, l1, k2, l2 = lanes_like(theta), lanes_like(theta), lanes_like(theta), lanes_like(theta)
    k3, l3, k4, l4 = lanes_like(theta), lanes_like(theta), lanes_like(theta), lanes_like(theta)
    at, rate, r_theta, r_rate = lanes_like(theta), lanes_like(theta), lanes_like(theta), lanes_like(theta)

    tangent = chords(segment, theta, arc)
    path = path_before(tendons, segment, theta)
    plus, minus = pulls_at_start(tendons, spool_input, path)
    tendon_torques(segment, theta, plus, minus, pull, slope)
    mass_matrix(segment, arc, tangent, mass)
    bias(segment, theta, omega, arc, tangent, pull, a0)
    yield_(tendons, segment, theta, omega, spool_input, a0)
    for i in range(n):
        a0[i] = -a0[i]
        for j in range(n):
            other_mass[i, j] = mass[i, j]
    factorise(other_mass)
    solve(other_mass, a0)
    residual_jacobians(segment, omega, a0, arc, tangent, slope, by_theta, lu)
    stiffen(tendons, segment, theta, omega, spool_input, path, by_theta)
    yield_jacobians(tendons, theta, omega, by_theta, lu)
    for i in range(n):
        for j in range(n):
            lu[i, j] = per_hg * mass[i, j] + lu[i, j] + hg * by_theta[i, j]
    factorise(lu)

    _stage(mass, by_theta, lu, hg, omega, a0, k1, l1)
    for i in range(n):
        r_theta[i] = omega[i] + 4.0 * per_h * k1[i]
        r_rate[i] = a0[i] + 4.0 * per_h * l1[i]
    _stage(mass, by_theta, lu, hg, r_theta, r_rate, k2, l2)

    for i in range(n):
        at[i] = theta[i] + 2.0 * k1[i]
        rate[i] = omega[i] + 2.0 * l1[i]
    _accelerations(segment, at, rate, spool_input, tendons, other_mass, a)
    for i in range(n):
        r_theta[i] = rate[i] + per_h * (k1[i] - k2[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i])
    _stage(mass, by_theta, lu, hg, r_theta, r_rate, k3, l3)

    for i in range(n):
        at[i] = at[i] + k3[i]
        rate[i] = rate[i] + l3[i]
    _accelerations(segment, at, rate, spool_input, tendons, other_mass, a)
    for i in range(n):
        r_theta[i] = rate[i] + per_h * (k1[i] - k2[i] - 8.0 / 3.0 * k3[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i] - 8.0 / 3.0 * l3[i])
    _stage(mass, by_theta, lu, hg, r_theta, r_rate, k4, l4)
    _stage(mass, by_theta, lu, hg, k4, l4, k1, l1)
    of_bend, of_rate = zero_like(h), zero_like(h)
    for i in range(n):
        theta[i] = at[i] + k4[i]
        omega[i] = rate[i] + l4[i]
        of_bend = of_bend + k1[i]
        of_rate = of_rate + l1[i]
    return of_bend / hg, of_rate / hg
