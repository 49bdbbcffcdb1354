"""End stops, creeping springs and inner friction of a wrist in two planes, in the integration step's residual.

Of a segment that bends by the vector u, a stop is met where |u| is, whatever its direction: it pushes back along u with
the torque of one plane's stop at that depth. Springs creep by each coordinate; friction is `wristctl.wrist.dahl`'s.
"""

from typing import Any

from wristctl.lanes.compiled import by_type, compiled, implements, nothing
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where
from wristctl.wrist.dahl import direction_of, resist, resist_slope
from wristctl.wrist.integrator import stop_contact
from wristctl.wrist.spatial.spatial_chain import springs_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, PulledTendons, RealTendons, row_of


@by_type
def yield_in_space(tendons: Any, wrist: Any, q: Any, rate: Any, spool_input: Any, r: Any) -> None:
    """`wristctl.wrist.integrator.yield_` of a wrist in two planes."""


@by_type
def yield_jacobians_in_space(tendons: Any, q: Any, rate: Any, by_q: Any, by_rate: Any) -> None:
    """`wristctl.wrist.integrator.yield_jacobians` of a wrist in two planes."""


implements(yield_in_space, NoTendons, ElasticTendons)(nothing)
implements(yield_jacobians_in_space, NoTendons, ElasticTendons)(nothing)


@compiled
def _depth(nonideal: Any, q: Any, rate: Any, k: int) -> Any:
    """How far the segment k is bent into its stop [rad], and the rate of that; the direction of its bend, and |u|."""
    y, z, size = direction_of(q[2 * k], q[2 * k + 1])
    depth = maximum(0.0, size - nonideal.stop / (len(q) // 2))
    return depth, y * rate[2 * k] + z * rate[2 * k + 1], y, z, size


@implements(yield_in_space, PulledTendons, RealTendons)
def _yield(tendons: Any, wrist: Any, q: Any, rate: Any, spool_input: Any, r: Any) -> None:
    nonideal, state, springs = tendons.nonideal, tendons.state, row_of(len(spool_input), 0)
    for k in range(len(q) // 2):
        depth, closing, along_y, along_z, _ = _depth(nonideal, q, rate, k)
        torque, _, _ = stop_contact(nonideal, len(q) // 2, depth, closing)
        y, z = state[springs + 2 * k], state[springs + 2 * k + 1]
        yy, yz, zz = springs_of(wrist.segment, k)
        crept_y, crept_z = yy * y + yz * z, yz * y + zz * z
        r[2 * k] = r[2 * k] + torque * along_y - nonideal.spring_creep * crept_y
        r[2 * k + 1] = r[2 * k + 1] + torque * along_z - nonideal.spring_creep * crept_z
    resist(tendons.inner, q, r)


@implements(yield_jacobians_in_space, PulledTendons, RealTendons)
def _yield_jacobians(tendons: Any, q: Any, rate: Any, by_q: Any, by_rate: Any) -> None:
    for k in range(len(q) // 2):
        depth, closing, along_y, along_z, size = _depth(tendons.nonideal, q, rate, k)
        torque, stiffness, damping = stop_contact(tendons.nonideal, len(q) // 2, depth, closing)
        per_size = 1.0 / where(size > 0.0, size, 1.0)
        across = torque * per_size
        # of the rate at which the depth grows, by u
        swept_y = per_size * damping * (rate[2 * k] - closing * along_y)
        swept_z = per_size * damping * (rate[2 * k + 1] - closing * along_z)
        y, z, firm = 2 * k, 2 * k + 1, stiffness - across
        by_q[y, y] = by_q[y, y] + across + along_y * (firm * along_y + swept_y)
        by_q[y, z] = by_q[y, z] + along_y * (firm * along_z + swept_z)
        by_q[z, y] = by_q[z, y] + along_z * (firm * along_y + swept_y)
        by_q[z, z] = by_q[z, z] + across + along_z * (firm * along_z + swept_z)
        by_rate[y, y] = by_rate[y, y] + damping * along_y * along_y
        by_rate[y, z] = by_rate[y, z] + damping * along_y * along_z
        by_rate[z, y] = by_rate[z, y] + damping * along_z * along_y
        by_rate[z, z] = by_rate[z, z] + damping * along_z * along_z
    resist_slope(tendons.inner, q, rate, by_q)
