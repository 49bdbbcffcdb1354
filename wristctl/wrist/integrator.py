"""One step of RODAS3 on the wrist, with the exact Jacobian.

RODAS3 (Sandu et al., Atmospheric Environment 31 (1997) 3459): Rosenbrock, four stages, third order, stiffly
accurate, L-stable, so that the fast modes of the light chord masses (1e4-1e5 1/s) need no small step. For a second
order system the 2n equations of each stage reduce to n:

    (M/(h gamma) + dr/d(rate) + h gamma dr/d(theta)) k_rate = M R_rate - h gamma dr/d(theta) R_theta,
    k_theta = h gamma (R_theta + k_rate).
"""

from typing import Any

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, planes_like, square_like
from wristctl.wrist.arcs import Chords
from wristctl.wrist.chain import chords, spring, tendon_torques
from wristctl.wrist.dahl import resist, resist_slope
from wristctl.wrist.dynamics import bias, equation_of_motion, mass_matrix
from wristctl.wrist.jacobian import residual_jacobians
from wristctl.wrist.plant import path_along, path_before
from wristctl.wrist.tendon_mechanics import (
    PATH,
    ElasticTendons,
    NoTendons,
    PulledTendons,
    RealTendons,
    pulls_along,
    pulls_at_start,
    row_of,
    stiffen,
)


@compiled
def factorise(a: Any) -> None:
    """LU factors of a square matrix, in place; the diagonal holds the pivots' reciprocals."""
    n = len(a)
    for k in range(n):
        a[k, k] = 1.0 / a[k, k]
        for i in range(k + 1, n):
            a[i, k] = a[i, k] * a[k, k]
            for j in range(k + 1, n):
                a[i, j] = a[i, j] - a[i, k] * a[k, j]


@compiled
def solve(lu: Any, b: Any) -> None:
    """Overwrite b with the solution of a x = b."""
    n = len(b)
    for i in range(1, n):
        for k in range(i):
            b[i] = b[i] - lu[i, k] * b[k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] = b[i] - lu[i, k] * b[k]
        b[i] = b[i] * lu[i, i]


@compiled
def _contact(nonideal: Any, n: int, theta: Any, omega: Any) -> Any:
    """Torque of a segment's end stop [N m], against its bend, and its derivatives by angle and by rate."""
    limit, stiffness = nonideal.stop / n, nonideal.stop_stiffness * n
    depth = theta - clip(theta, -limit, limit)
    damped = 1.0 + nonideal.stop_dissipation * where(depth < 0.0, -omega, omega)
    touching = where((abs(depth) > 0.0) & (damped > 0.0), 1.0, 0.0)
    torque = stiffness * depth * damped * touching
    return torque, stiffness * damped * touching, stiffness * nonideal.stop_dissipation * abs(depth) * touching


@by_type
def yield_(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, r: Any) -> None:
    """Add to the residual r (n,) what end stops and inner friction take and what creeping springs give."""
    raise NotImplementedError("compiled code only")


@by_type
def yield_jacobians(tendons: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    """Add what end stops and inner friction add to dr/d(theta) and dr/d(rate), (n, n)."""
    raise NotImplementedError("compiled code only")


@implements(yield_, NoTendons, ElasticTendons)
def _stay(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, r: Any) -> None:
    pass


@implements(yield_jacobians, NoTendons, ElasticTendons)
def _stay_jacobians(tendons: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    pass


@implements(yield_, PulledTendons, RealTendons)
def _yield(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, r: Any) -> None:
    nonideal, state, springs = tendons.nonideal, tendons.state, row_of(len(spool_input), PATH)
    for k in range(len(theta)):
        torque, _, _ = _contact(nonideal, len(theta), theta[k], omega[k])
        r[k] = r[k] + torque - nonideal.spring_creep * spring(segment, k) * state[springs + k]
    resist(tendons.inner, theta, r)


@implements(yield_jacobians, PulledTendons, RealTendons)
def _yield_jacobians(tendons: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    for k in range(len(theta)):
        _, stiffness, damping = _contact(tendons.nonideal, len(theta), theta[k], omega[k])
        by_theta[k, k] = by_theta[k, k] + stiffness
        by_rate[k, k] = by_rate[k, k] + damping
    resist_slope(tendons.inner, theta, omega, by_theta)


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
    angle, rate, r_theta, r_rate = lanes_like(theta), lanes_like(theta), lanes_like(theta), lanes_like(theta)

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
        angle[i] = theta[i] + 2.0 * k1[i]
        rate[i] = omega[i] + 2.0 * l1[i]
    _accelerations(segment, angle, rate, spool_input, tendons, other_mass, a)
    for i in range(n):
        r_theta[i] = rate[i] + per_h * (k1[i] - k2[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i])
    _stage(mass, by_theta, lu, hg, r_theta, r_rate, k3, l3)

    for i in range(n):
        angle[i] = angle[i] + k3[i]
        rate[i] = rate[i] + l3[i]
    _accelerations(segment, angle, rate, spool_input, tendons, other_mass, a)
    for i in range(n):
        r_theta[i] = rate[i] + per_h * (k1[i] - k2[i] - 8.0 / 3.0 * k3[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i] - 8.0 / 3.0 * l3[i])
    _stage(mass, by_theta, lu, hg, r_theta, r_rate, k4, l4)
    _stage(mass, by_theta, lu, hg, k4, l4, k1, l1)
    of_bend, of_rate = zero_like(h), zero_like(h)
    for i in range(n):
        theta[i] = angle[i] + k4[i]
        omega[i] = rate[i] + l4[i]
        of_bend = of_bend + k1[i]
        of_rate = of_rate + l1[i]
    return of_bend / hg, of_rate / hg
