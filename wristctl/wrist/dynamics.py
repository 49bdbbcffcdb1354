"""The fast form of the dynamics (E6): point masses at chord middles and a hand on the last tangent.

With p_k the place of mass k and J_ki its derivative by theta_i, the motion obeys

    r_i = sum_k J_ki . (m_k (p_k'' - g)) - J_tip,i . F + D theta_i' + K theta_i - tau_i = 0.

Planar vectors are complex numbers: i v turns v by 90 degrees. Beyond segment i everything turns rigidly about
Q_i = P_i + i z_i' (P_i the segment's end, z_i' its chord's derivative), so J_ki = i (p_k - Q_i), and sums over the
masses beyond a segment give M and both Jacobians of r in O(n^2).
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import dot, planar, turn, zero_like
from wristctl.lanes.rows import lanes_like, planes_like
from wristctl.wrist.arcs import Chords
from wristctl.wrist.chain import chords, spring, tendon_torques


@compiled
def mass_matrix(segment: Any, arc: Any, tangent: Any, mass: Any) -> None:
    """M = sum m J^T J (E7) into `mass`, from the chords and the last tangent."""
    z, dz = arc.z, arc.dz
    end = planes_like(z)
    end[0] = z[0]
    for k in range(1, len(z)):
        end[k] = end[k - 1] + z[k]
    # zeroth, first and second moment of the masses beyond segment j
    m0 = segment.hand_mass
    place = end[len(z) - 1] + segment.hand_offset * tangent
    m1 = m0 * place
    m2 = m0 * dot(place, place)
    for j in range(len(z) - 1, -1, -1):
        q_j = end[j] + turn(dz[j])
        middle = end[j] + -0.5 * z[j]
        half_moment = 0.5 * segment.mass * dz[j]
        mass[j, j] = m2 - 2.0 * dot(q_j, m1) + m0 * dot(q_j, q_j) + 0.5 * dot(half_moment, dz[j])
        for i in range(j):
            q_i = end[i] + turn(dz[i])
            beyond = m2 - dot(q_i + q_j, m1) + m0 * dot(q_i, q_j)
            mass[i, j] = beyond + dot(half_moment, turn(middle - q_i))
            mass[j, i] = mass[i, j]
        m0 = m0 + segment.mass
        m1 = m1 + segment.mass * middle
        m2 = m2 + segment.mass * dot(middle, middle)


@compiled
def bias(segment: Any, theta: Any, omega: Any, arc: Any, tangent: Any, pull: Any, r: Any) -> None:
    """r at theta'' = 0, so that M theta'' + bias = r, by Newton and Euler: forces outward to tip, torques back.

    `pull` holds the tendons' torque on each segment.
    """
    z, dz, d2z = arc.z, arc.dz, arc.d2z
    force = planes_like(z)
    weight = planar(segment.gravity_x, segment.gravity_y)
    spin = zero_like(segment.length)
    a = planar(spin, spin)
    for k in range(len(z)):
        w = omega[k]
        bent = w * w * d2z[k]
        if k > 0:  # the base does not turn
            bent = bent + 2.0 * spin * w * turn(dz[k]) - spin * spin * z[k]
        force[k] = segment.mass * (a + 0.5 * bent - weight)
        a = a + bent
        spin = spin + w
    hand = segment.hand_offset * tangent
    beyond = segment.hand_mass * (a - spin * spin * hand - weight)
    torque = dot(turn(hand), beyond)
    beyond = beyond - planar(segment.force_x, segment.force_y)
    for k in range(len(z) - 1, -1, -1):
        passive = spring(segment, k) * theta[k] + segment.damping * omega[k] - pull[k]
        r[k] = torque + dot(dz[k], beyond + 0.5 * force[k]) + passive
        torque = torque + dot(turn(z[k]), beyond + 0.5 * force[k])
        beyond = beyond + force[k]


@compiled
def equation_of_motion(segment: Any, theta: Any, omega: Any, plus: Any, minus: Any, mass: Any, r: Any) -> None:
    """M and the remaining terms of E6, so that M theta'' + r = 0."""
    arc = Chords(planes_like(theta), planes_like(theta), planes_like(theta), planes_like(theta))
    pull, slope = lanes_like(theta), lanes_like(theta)
    tangent = chords(segment, theta, arc)
    tendon_torques(segment, theta, plus, minus, pull, slope)
    mass_matrix(segment, arc, tangent, mass)
    bias(segment, theta, omega, arc, tangent, pull, r)
