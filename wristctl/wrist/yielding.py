"""End stops and creeping springs, which the integration step adds to the residual of the equation of motion.

End stops are Hunt and Crossley's contact, k d (1 + c d') at a depth d (J. Appl. Mech. 42 (1975) 440), shared by all
segments; a spring's torque is K (theta - f psi), psi the creep of one Maxwell branch as in `wristctl.wrist.elastic`.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import where
from wristctl.wrist.chain import spring
from wristctl.wrist.elastic import PATH, row_of


@compiled
def _contact(nonideal: Any, n: int, theta: Any, omega: Any) -> Any:
    """Torque of a segment's end stop [N m], against its bend, and its derivatives by angle and by rate."""
    limit, stiffness = nonideal.stop / n, nonideal.stop_stiffness * n
    depth = theta - clip(theta, -limit, limit)
    zero = 0.0 * theta
    damped = 1.0 + nonideal.stop_dissipation * where(depth < zero, -omega, omega)
    touching = where((abs(depth) > zero) & (damped > zero), 1.0 + zero, zero)
    torque = stiffness * depth * damped * touching
    return torque, stiffness * damped * touching, stiffness * nonideal.stop_dissipation * abs(depth) * touching


@compiled
def yield_(tendons: Any, segment: Any, theta: Any, omega: Any, given: Any, r: Any) -> None:
    """Add to the residual r (n,) what end stops take and what creeping springs give."""
    if tendons is not None:
        _yield(tendons.nonideal, tendons.state, segment, theta, omega, row_of(len(given), PATH), r)


@compiled
def _yield(nonideal: Any, state: Any, segment: Any, theta: Any, omega: Any, springs: int, r: Any) -> None:
    if nonideal is not None:
        for k in range(len(theta)):
            torque, _, _ = _contact(nonideal, len(theta), theta[k], omega[k])
            r[k] = r[k] + torque - nonideal.spring_creep * spring(segment, k) * state[springs + k]


@compiled
def yield_jacobians(tendons: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    """Add what end stops add to dr/d(theta) and dr/d(rate), (n, n)."""
    if tendons is not None:
        _yield_jacobians(tendons.nonideal, theta, omega, by_theta, by_rate)


@compiled
def _yield_jacobians(nonideal: Any, theta: Any, omega: Any, by_theta: Any, by_rate: Any) -> None:
    if nonideal is not None:
        for k in range(len(theta)):
            _, stiffness, damping = _contact(nonideal, len(theta), theta[k], omega[k])
            by_theta[k, k] = by_theta[k, k] + stiffness
            by_rate[k, k] = by_rate[k, k] + damping
