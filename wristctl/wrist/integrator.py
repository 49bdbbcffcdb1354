"""One step of RODAS3 with the exact Jacobian, and that of the planar wrist.

RODAS3 (Sandu et al., Atmospheric Environment 31 (1997) 3459): Rosenbrock, four stages, third order, stiffly
accurate, L-stable, so that the fast modes of the light chord masses (1e4-1e5 1/s) need no small step. For a second
order system the 2n equations of each stage reduce to n:

    (M/(h gamma) + dr/d(rate) + h gamma dr/d(theta)) k_rate = M R_rate - h gamma dr/d(theta) R_theta,
    k_theta = h gamma (R_theta + k_rate).
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements, nothing, spelled_out
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
def stop_contact(nonideal: Any, n: int, depth: Any, closing: Any) -> Any:
    """Hunt and Crossley's torque of an end stop of one of n segments that is bent so far into it [N m].

    `closing` is the rate at which the depth grows [rad/s]. Also the torque's derivatives by depth and by that rate.
    """
    stiffness = nonideal.stop_stiffness * n
    damped = 1.0 + nonideal.stop_dissipation * closing
    touching = where((abs(depth) > 0.0) & (damped > 0.0), 1.0, 0.0)
    torque = stiffness * depth * damped * touching
    return torque, stiffness * damped * touching, stiffness * nonideal.stop_dissipation * abs(depth) * touching


@compiled
def _contact(nonideal: Any, n: int, theta: Any, omega: Any) -> Any:
    """Torque of a segment's end stop [N m], against its bend, and its derivatives by angle and by rate."""
    limit = nonideal.stop / n
    depth = theta - clip(theta, -limit, limit)
    return stop_contact(nonideal, n, depth, where(depth < 0.0, -omega, omega))


@by_type
def yield_(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, r: Any) -> None:
    """Add to the residual r (n,) what end stops and inner friction take and what creeping springs give."""


@by_type
def yield_jacobians(tendons: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    """Add what end stops and inner friction add to dr/d(theta) and dr/d(rate), (n, n)."""


implements(yield_, NoTendons, ElasticTendons)(nothing)


implements(yield_jacobians, NoTendons, ElasticTendons)(nothing)


@implements(yield_, PulledTendons, RealTendons)
def _yield(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, r: Any) -> None:
    nonideal, state, springs = tendons.nonideal, tendons.state, row_of(len(spool_input), 0)
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


class Held(NamedTuple):
    """What stays over a step: the plant, what its spools hold, and its tendons."""

    plant: Any
    spool_input: Any
    tendons: Any


class Linear(NamedTuple):
    """M q'' + r = 0 linearised, in rows: M, a matrix to work on, q'', and r's derivatives by q and by rate there."""

    mass: Any
    factors: Any
    acceleration: Any
    by_q: Any
    by_rate: Any


@compiled
def _accelerations(held: Any, theta: Any, omega: Any, mass: Any, a: Any) -> None:
    """-theta'' into `a`, with `mass` to work on."""
    segment, spool_input, tendons = held.plant, held.spool_input, held.tendons
    plus, minus = pulls_along(tendons, spool_input, path_along(tendons, segment, theta))
    equation_of_motion(segment, theta, omega, plus, minus, mass, a)
    yield_(tendons, segment, theta, omega, spool_input, a)
    factorise(mass)
    solve(mass, a)


@compiled
def accelerate(mass: Any, factors: Any, a: Any) -> None:
    """From the residual r in `a` to q'' = -M^-1 r, with `factors` to work on."""
    n = len(a)
    for i in range(n):
        a[i] = -a[i]
        for j in range(n):
            factors[i, j] = mass[i, j]
    factorise(factors)
    solve(factors, a)


@spelled_out
def _linearised(held: Any, theta: Any, omega: Any, linear: Any) -> None:
    segment, spool_input, tendons = held.plant, held.spool_input, held.tendons
    arc = Chords(planes_like(theta), planes_like(theta), planes_like(theta), planes_like(theta))
    pull, slope = lanes_like(theta), lanes_like(theta)
    tangent = chords(segment, theta, arc)
    path = path_before(tendons, segment, theta)
    plus, minus = pulls_at_start(tendons, spool_input, path)
    tendon_torques(segment, theta, plus, minus, pull, slope)
    mass_matrix(segment, arc, tangent, linear.mass)
    bias(segment, theta, omega, arc, tangent, pull, linear.acceleration)
    yield_(tendons, segment, theta, omega, spool_input, linear.acceleration)
    accelerate(linear.mass, linear.factors, linear.acceleration)
    residual_jacobians(segment, omega, linear.acceleration, arc, tangent, slope, linear.by_q, linear.by_rate)
    stiffen(tendons, segment, theta, omega, spool_input, path, linear.by_q)
    yield_jacobians(tendons, theta, omega, linear.by_q, linear.by_rate)


@spelled_out
def rodas3(
    linearised: Any, accelerations: Any, held: Any, q: Any, rate: Any, h: Any, last_q: Any, last_rate: Any
) -> None:
    """Advance coordinates and rates of M q'' + r = 0 by h [s].

    Parameters
    ----------
    linearised
        Function (held, q, rate, linear) that fills Linear.
    accelerations
        Function (held, q, rate, mass, a) that puts -q'' into `a`, with `mass` to work on.
    held
        Held, which these two read.
    last_q, last_rate
        Rows for the filtered difference to the embedded solution, times half of h.
    """
    n = len(q)
    hg = 0.5 * h
    per_h, per_hg = 1.0 / h, 2.0 / h
    mass, other_mass, lu, by_q = square_like(q), square_like(q), square_like(q), square_like(q)
    a0, a = lanes_like(q), lanes_like(q)
    k1, l1, k2, l2 = lanes_like(q), lanes_like(q), lanes_like(q), lanes_like(q)
    k3, l3, k4, l4 = lanes_like(q), lanes_like(q), lanes_like(q), lanes_like(q)
    at, speed, r_q, r_rate = lanes_like(q), lanes_like(q), lanes_like(q), lanes_like(q)

    linearised(held, q, rate, Linear(mass, other_mass, a0, by_q, lu))
    for i in range(n):
        for j in range(n):
            lu[i, j] = per_hg * mass[i, j] + lu[i, j] + hg * by_q[i, j]
    factorise(lu)

    _stage(mass, by_q, lu, hg, rate, a0, k1, l1)
    for i in range(n):
        r_q[i] = rate[i] + 4.0 * per_h * k1[i]
        r_rate[i] = a0[i] + 4.0 * per_h * l1[i]
    _stage(mass, by_q, lu, hg, r_q, r_rate, k2, l2)

    for i in range(n):
        at[i] = q[i] + 2.0 * k1[i]
        speed[i] = rate[i] + 2.0 * l1[i]
    accelerations(held, at, speed, other_mass, a)
    for i in range(n):
        r_q[i] = speed[i] + per_h * (k1[i] - k2[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i])
    _stage(mass, by_q, lu, hg, r_q, r_rate, k3, l3)

    for i in range(n):
        at[i] = at[i] + k3[i]
        speed[i] = speed[i] + l3[i]
    accelerations(held, at, speed, other_mass, a)
    for i in range(n):
        r_q[i] = speed[i] + per_h * (k1[i] - k2[i] - 8.0 / 3.0 * k3[i])
        r_rate[i] = -a[i] + per_h * (l1[i] - l2[i] - 8.0 / 3.0 * l3[i])
    _stage(mass, by_q, lu, hg, r_q, r_rate, k4, l4)
    _stage(mass, by_q, lu, hg, k4, l4, last_q, last_rate)
    for i in range(n):
        q[i] = at[i] + k4[i]
        rate[i] = speed[i] + l4[i]


@compiled
def step(segment: Any, theta: Any, omega: Any, spool_input: Any, tendons: Any, h: Any) -> Any:
    """Advance angles and rates by h [s] with `spool_input` held: pulls [N] of both sides, or what spools reeled in [m].

    Elastic tendons and their friction are evaluated at each stage, and their tangent is in the Jacobian. Returns by how
    much the bend and its rate [rad, rad/s] differ from the embedded solution of second order. That difference is the
    last stage; its share in stiff modes, which die out within the step and say nothing of the error, is filtered out by
    (1 - h gamma J)^-1 (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8).
    """
    last_theta, last_omega = lanes_like(theta), lanes_like(theta)
    held = Held(segment, spool_input, tendons)
    rodas3(_linearised, _accelerations, held, theta, omega, h, last_theta, last_omega)
    of_bend, of_rate = zero_like(h), zero_like(h)
    for i in range(len(theta)):
        of_bend = of_bend + last_theta[i]
        of_rate = of_rate + last_omega[i]
    hg = 0.5 * h
    return of_bend / hg, of_rate / hg
