"""Exact derivatives of the dynamics' residual r by theta and by its rate (see dynamics.py for the notation).

Turning segment j turns all that lies beyond it. If accelerations less gravity turned with it, no r_i further out
would change; what is missing is one uniform field, w_j = b_j - i (a_j - g), with a_j the acceleration of P_j and
b_j = d(z_j'')/d(theta_j). Likewise d(p_k'')/d(rate_j) = 2 dJ_kj/dt, and dJ_kj/dt = i v_k + u_j beyond segment j.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import dot, planar, turn, zero_like
from wristctl.lanes.rows import planes_like
from wristctl.wrist.chain import spring


@compiled
def residual_jacobians(
    segment: Any, omega: Any, acceleration: Any, arc: Any, tangent: Any, slope: Any, by_theta: Any, by_rate: Any
) -> None:
    """dr/d(theta) and dr/d(rate) at the given accelerations, into two n x n matrices [i, j].

    `slope` holds the derivative of the tendons' torque on each segment by its angle.
    """
    z, dz, d2z, d3z = arc.z, arc.dz, arc.d2z, arc.d3z
    n = len(z)
    pivot, end, middle = planes_like(z), planes_like(z), planes_like(z)
    velocity, force = planes_like(z), planes_like(z)
    field, sweep, own_field, own_sweep = planes_like(z), planes_like(z), planes_like(z), planes_like(z)
    weight = planar(segment.gravity_x, segment.gravity_y)
    spin = zero_like(segment.length)
    spin_rate = spin
    p, v, a = planar(spin, spin), planar(spin, spin), planar(spin, spin)
    for k in range(n):
        w = omega[k]
        rate = w * dz[k]
        bent = acceleration[k] * dz[k] + w * w * d2z[k]
        own_field[k] = acceleration[k] * d2z[k] + w * w * d3z[k]
        own_sweep[k] = w * d2z[k]
        if k > 0:  # the base does not turn
            turning, across = planar(-spin * spin, spin_rate), 2.0 * spin * w
            rate = rate + spin * turn(z[k])
            bent = bent + turning * z[k] + across * turn(dz[k])
            own_field[k] = own_field[k] + turning * dz[k] + across * turn(d2z[k])
            own_sweep[k] = own_sweep[k] + spin * turn(dz[k])
        middle[k] = p + 0.5 * z[k]
        velocity[k] = v + 0.5 * rate
        force[k] = segment.mass * (a + 0.5 * bent - weight)
        p, v, a = p + z[k], v + rate, a + bent
        end[k] = p
        pivot[k] = p + turn(dz[k])
        field[k] = own_field[k] - turn(a - weight)
        sweep[k] = own_sweep[k] - turn(v)
        spin = spin + w
        spin_rate = spin_rate + acceleration[k]

    hand = segment.hand_offset * tangent
    load = planar(segment.force_x, segment.force_y)
    # sums over the masses beyond segment j: mass, m p, m v, m p.v, and force
    m0 = segment.hand_mass
    m1 = m0 * (p + hand)
    momentum = m0 * (v + spin * turn(hand))
    stretch = dot(p + hand, momentum)
    beyond = m0 * (a + planar(-spin * spin, spin_rate) * hand - weight) - load
    for j in range(n - 1, -1, -1):
        half = 0.5 * dz[j]
        half_moment = segment.mass * half
        moment_j = turn(m1 - m0 * pivot[j])
        # all masses from segment j on, seen by theta_j: for columns of segments nearer the base
        moment_with_half = moment_j + half_moment
        circling = stretch - dot(pivot[j], momentum) + dot(half_moment, turn(velocity[j]))
        tip_turned = dot(turn(p - pivot[j]), turn(load))
        for i in range(j):
            by_theta[j, i] = dot(moment_with_half, field[i]) + tip_turned
            by_rate[j, i] = 2.0 * (circling + dot(moment_with_half, sweep[i]))
            # row i, column j: segment j lies beyond segment i
            moment = turn(m1 - m0 * pivot[i])
            reach = 0.5 * segment.mass * turn(middle[j] - pivot[i])
            shifted = dot(pivot[j] - pivot[i], beyond) + dot(turn(half), force[j])
            tip_i = dot(turn(p - pivot[i]), turn(load))
            by_theta[i, j] = shifted + dot(moment, field[j]) + dot(reach, own_field[j]) + tip_i
            turned = stretch - dot(pivot[i], momentum)
            by_rate[i, j] = 2.0 * (turned + dot(moment, sweep[j]) + dot(reach, own_sweep[j]))
        curved = dot(d2z[j], beyond + 0.5 * force[j]) - dot(turn(dz[j]), beyond)
        inertial = dot(moment_j, field[j]) + 0.5 * dot(half_moment, own_field[j])
        by_theta[j, j] = curved + inertial + tip_turned + spring(segment, j) - slope[j]
        turned = stretch - dot(pivot[j], momentum) + dot(moment_j, sweep[j]) + 0.5 * dot(half_moment, own_sweep[j])
        by_rate[j, j] = 2.0 * turned + segment.damping
        m0 = m0 + segment.mass
        m1 = m1 + segment.mass * middle[j]
        momentum = momentum + segment.mass * velocity[j]
        stretch = stretch + segment.mass * dot(middle[j], velocity[j])
        beyond = beyond + force[j]
