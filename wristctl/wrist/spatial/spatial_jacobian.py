"""Exact derivatives of the residual r of the dynamics in two planes (see `posture` and `spatial_dynamics`).

With the screw S_j = (w, v) of a coordinate of segment j and its two derivatives along the motion, a point x beyond
moves by d(x)/dq_j = v + w x x, d(x'')/dq_j = v'' + w'' x x + 2 w' x x' + w x x'', and d(x'')/d(rate_j) is twice
d(x)/dq_j's derivative along the motion. Sums over the masses beyond give every entry as a product of two screws: with
their momenta under the changed acceleration where j lies beyond i, with their momenta under S_i where it does not.
Gravity is taken off the accelerations, and where the screw turns it the correction stands in its second derivative;
a force on the tip stays as it is in space, and is put right by itself.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled, spelled_out
from wristctl.lanes.lane import dot, zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.lanes.space import cross, space, spaces_like
from wristctl.wrist.spatial.posture import series_of, turn_pairs
from wristctl.wrist.spatial.spatial_chain import chord_of, chord_unit, springs_of
from wristctl.wrist.spatial.spatial_dynamics import (
    bulk_of,
    circling,
    force_of,
    gathered,
    gravity_of,
    momentum,
    plus,
    times,
)
from wristctl.wrist.spatial.stumpff import slopes


class Motion(NamedTuple):
    """Rows: by segment the chord's middle, its velocity and the force that accelerates its mass; by coordinate
    derivatives of chord and screw."""

    middle: Any
    velocity: Any
    force: Any
    chord_yy: Any
    """Second derivatives of the chord by its segment's bends, by segment."""
    chord_yz: Any
    chord_zz: Any
    spin_by_y: Any
    """Derivative of the coordinate's w by its segment's u_y, in axes that stay."""
    spin_by_z: Any
    chord_1: Any
    """First derivative of `chord_by` along the motion, and the second."""
    chord_2: Any
    spin_1: Any
    move_1: Any
    """First derivative of the screw along the motion, and the second."""
    spin_2: Any
    move_2: Any


@spelled_out
def _motion_like(q: Any, chords: Any) -> Any:
    return Motion(
        spaces_like(chords), spaces_like(chords), spaces_like(chords),
        spaces_like(chords), spaces_like(chords), spaces_like(chords),
        spaces_like(q), spaces_like(q), spaces_like(q), spaces_like(q),
        spaces_like(q), spaces_like(q), spaces_like(q), spaces_like(q),
    )  # fmt: skip


@compiled
def _transposed_times(tensor: Any, v: Any) -> Any:
    return v.x * tensor.x + v.y * tensor.y + v.z * tensor.z


@compiled
def _along_motion(segment: Any, q: Any, rate: Any, acceleration: Any, posture: Any, k: int, motion: Any) -> None:
    """Derivatives of a segment's chord and of its w, in axes that stay as the frame before it stands.

    Along the motion is by x twice and by y once, x the rate and y the acceleration of the segment's bend u.
    """
    y, z, length = 2 * k, 2 * k + 1, chord_unit(segment)
    c = series_of(posture, k)
    d = slopes(c)
    part = chord_of(segment, c)
    # slopes of the slopes: d_k's is k d_{k+2} - d_{k+1}
    e1, e2, e3 = d.d3 - d.d2, 2.0 * d.d4 - d.d3, 3.0 * d.d5 - d.d4
    ux = q[y] * rate[y] + q[z] * rate[z]
    uy_xx = q[y] * acceleration[y] + q[z] * acceleration[z] + rate[y] * rate[y] + rate[z] * rate[z]
    twice = ux * ux
    tangent, nu = posture.tangent[k], posture.bend[k]
    nx = rate[y] * posture.normal[y] + rate[z] * posture.normal[z]
    ny = acceleration[y] * posture.normal[y] + acceleration[z] * posture.normal[z]
    about_u = q[y] * posture.axis[y] + q[z] * posture.axis[z]
    about_x = rate[y] * posture.axis[y] + rate[z] * posture.axis[z]
    about_y = acceleration[y] * posture.axis[y] + acceleration[z] * posture.axis[z]

    stretched = (length * part.along_1) * tangent + (length * part.lean_1) * nu
    curved = (length * part.along_2) * tangent + (length * part.lean_2) * nu
    lean = length * part.lean_1
    motion.chord_yy[k] = (q[y] * q[y]) * curved + (2.0 * lean * q[y]) * posture.normal[y] + stretched
    motion.chord_zz[k] = (q[z] * q[z]) * curved + (2.0 * lean * q[z]) * posture.normal[z] + stretched
    across = (lean * q[z]) * posture.normal[y] + (lean * q[y]) * posture.normal[z]
    motion.chord_yz[k] = (q[y] * q[z]) * curved + across

    # second derivatives of the chord along the motion, over u_a, x_a, y_a and along n_a
    along_twice = part.along_2 * uy_xx + part.along_3 * twice
    lean_twice = part.lean_2 * uy_xx + part.lean_3 * twice
    by_u = (length * along_twice) * tangent + (length * lean_twice) * nu
    by_u = by_u + (2.0 * length * part.lean_2 * ux) * nx + lean * ny
    by_x = (2.0 * length * part.along_2 * ux) * tangent + (2.0 * length * part.lean_2 * ux) * nu + (2.0 * lean) * nx
    d1_twice, d2_twice, d3_twice = (
        d.d1 * uy_xx + e1 * twice,
        d.d2 * uy_xx + e2 * twice,
        d.d3 * uy_xx + e3 * twice,
    )
    leaning = part.lean_1 * uy_xx + part.lean_2 * twice
    # and of w
    spun_u = d3_twice * about_u + (2.0 * d.d3 * ux) * about_x + c.c3 * about_y
    spun_x = (2.0 * d.d3 * ux) * about_u + (2.0 * c.c3) * about_x
    spun_y = c.c3 * about_u
    turned_u, turned_x, turned_y = posture.turned, lanes_like(q), lanes_like(q)
    turn_pairs(rate, k, turned_x)
    turn_pairs(acceleration, k, turned_y)
    for i in range(y, z + 1):
        u_i, x_i, y_i, axis, normal = q[i], rate[i], acceleration[i], posture.axis[i], posture.normal[i]
        motion.spin_by_y[i] = (
            (d.d2 * q[y] * turned_u[i]) * tangent + (d.d1 * q[y]) * axis + (d.d3 * u_i * q[y]) * about_u
        )
        motion.spin_by_y[i] = motion.spin_by_y[i] + (c.c3 * u_i) * posture.axis[y]
        motion.spin_by_z[i] = (
            (d.d2 * q[z] * turned_u[i]) * tangent + (d.d1 * q[z]) * axis + (d.d3 * u_i * q[z]) * about_u
        )
        motion.spin_by_z[i] = motion.spin_by_z[i] + (c.c3 * u_i) * posture.axis[z]
        motion.chord_2[i] = u_i * by_u + x_i * by_x + y_i * stretched + (length * leaning) * normal
        twisted = d2_twice * turned_u[i] + 2.0 * d.d2 * ux * turned_x[i] + c.c2 * turned_y[i]
        motion.spin_2[i] = twisted * tangent + d1_twice * axis + u_i * spun_u + x_i * spun_x + y_i * spun_y
    # of w itself by the coordinate that it belongs to, and of -u_z and u_y by the other
    motion.spin_by_y[y] = motion.spin_by_y[y] + spun_y
    motion.spin_by_y[z] = motion.spin_by_y[z] + c.c2 * tangent
    motion.spin_by_z[y] = motion.spin_by_z[y] - c.c2 * tangent
    motion.spin_by_z[z] = motion.spin_by_z[z] + spun_y
    motion.chord_1[y] = rate[y] * motion.chord_yy[k] + rate[z] * motion.chord_yz[k]
    motion.chord_1[z] = rate[y] * motion.chord_yz[k] + rate[z] * motion.chord_zz[k]
    motion.spin_1[y] = rate[y] * motion.spin_by_y[y] + rate[z] * motion.spin_by_z[y]
    motion.spin_1[z] = rate[y] * motion.spin_by_y[z] + rate[z] * motion.spin_by_z[z]


@compiled
def spatial_jacobians(segment: Any, q: Any, rate: Any, acceleration: Any, bent: Any, by_q: Any, by_rate: Any) -> None:
    """dr/dq and dr/d(rate) of a BentWrist at the given accelerations, into two matrices [i, j]."""
    posture, tangent, momenta, torques = bent.posture, bent.tangent, bent.momenta, bent.torques
    n, zero = len(posture.chord), zero_like(segment.length)
    motion = _motion_like(q, posture.chord)
    force_turned, stretch_turned = spaces_like(q), spaces_like(q)
    nothing = space(zero, zero, zero)
    place, velocity, a, spin, spin_rate = nothing, nothing, nothing, nothing, nothing
    weight = gravity_of(segment)
    for k in range(n):
        y, z = 2 * k, 2 * k + 1
        _along_motion(segment, q, rate, acceleration, posture, k, motion)
        chord = posture.chord[k]
        swept = rate[y] * posture.chord_by[y] + rate[z] * posture.chord_by[z]
        spun = rate[y] * posture.spin[y] + rate[z] * posture.spin[z]
        bent = rate[y] * motion.chord_1[y] + rate[z] * motion.chord_1[z]
        bent = bent + acceleration[y] * posture.chord_by[y] + acceleration[z] * posture.chord_by[z]
        turned = rate[y] * motion.spin_1[y] + rate[z] * motion.spin_1[z]
        turned = turned + acceleration[y] * posture.spin[y] + acceleration[z] * posture.spin[z]
        chord_rate = swept
        if k > 0:  # the base does not turn
            carried = cross(spin, chord)
            bent = bent + cross(spin_rate, chord) + cross(spin, carried + 2.0 * swept)
            turned = turned + cross(spin, spun)
            chord_rate = swept + carried
        motion.middle[k] = place + 0.5 * chord
        motion.velocity[k] = velocity + 0.5 * chord_rate
        motion.force[k] = segment.mass * (a + 0.5 * bent - weight)
        place, velocity, a = posture.end[k], velocity + chord_rate, a + bent
        for i in range(y, z + 1):
            w, w_1, w_2 = posture.spin[i], motion.spin_1[i], motion.spin_2[i]
            if k > 0:
                c, c_1 = posture.chord_by[i], motion.chord_1[i]
                w_turned, c_turned = cross(spin, w), cross(spin, c)
                w_2 = w_2 + cross(spin_rate, w) + cross(spin, w_turned + 2.0 * w_1)
                motion.chord_2[i] = motion.chord_2[i] + cross(spin_rate, c) + cross(spin, c_turned + 2.0 * c_1)
                motion.chord_1[i] = c_1 + c_turned
                w_1 = w_1 + w_turned
            motion.spin_1[i] = w_1
            motion.spin_2[i] = w_2
            motion.move_1[i] = motion.chord_1[i] - cross(w_1, place) - cross(w, velocity)
            move_2 = motion.chord_2[i] - cross(w_2, place) - 2.0 * cross(w_1, velocity)
            motion.move_2[i] = move_2 - cross(w, a - weight)
        spin_rate = spin_rate + turned
        spin = spin + spun

    hand = segment.hand_offset * tangent
    tip, load = place, force_of(segment)
    moment_of_load = cross(tip, load)
    place, velocity = tip + hand, velocity + cross(spin, hand)
    # sums over all beyond: masses, linear momentum, place with momentum, force, and moment about the origin
    beyond, linear = bulk_of(segment.hand_mass, place), segment.hand_mass * velocity
    circle = circling(place, linear)
    force = segment.hand_mass * (a + cross(spin_rate, hand) + cross(spin, cross(spin, hand)) - weight)
    moment = cross(place, force)
    half_mass = 0.5 * segment.mass
    angular_q, linear_q, angular_rate, linear_rate = spaces_like(q), spaces_like(q), spaces_like(q), spaces_like(q)
    for j in range(n - 1, -1, -1):
        y, z = 2 * j, 2 * j + 1
        middle, own_force = motion.middle[j], motion.force[j]
        total = force - load
        about_end = moment - moment_of_load - cross(posture.end[j], total)
        on_chord = total + 0.5 * own_force
        for i in range(y, z + 1):
            w, move, w_1 = posture.spin[i], posture.move[i], motion.spin_1[i]
            angular_2, linear_2 = momentum(beyond, motion.spin_2[i], motion.move_2[i])
            angular_1, linear_1 = momentum(beyond, w_1, motion.move_1[i])
            on_load = cross(move + cross(w, tip), load)
            angular_2 = angular_2 + 2.0 * _transposed_times(circle, w_1) + cross(w, moment) + cross(move, force)
            angular_q[i] = angular_2 - on_load
            linear_q[i] = linear_2 + 2.0 * cross(w_1, linear) + cross(w, force)
            angular_rate[i] = 2.0 * (angular_1 + _transposed_times(circle, w))
            linear_rate[i] = 2.0 * (linear_1 + cross(w, linear))
            force_turned[i] = on_load
            half_chord = half_mass * posture.chord_by[i]
            swept = cross(linear, move) + times(circle, w) + cross(motion.velocity[j], half_chord)
            stretch_turned[i] = 2.0 * swept
        for i in range(y, z + 1):
            w, move, chord_by = posture.spin[i], posture.move[i], posture.chord_by[i]
            for b in range(y, z + 1):
                held = 0.5 * half_mass * dot(chord_by, motion.chord_2[b]) - dot(cross(w, posture.chord_by[b]), total)
                by_q[i, b] = dot(w, angular_q[b]) + dot(move, linear_q[b]) + held
                damped = half_mass * dot(chord_by, motion.chord_1[b])
                by_rate[i, b] = dot(w, angular_rate[b]) + dot(move, linear_rate[b]) + damped
            by_q[i, y] = by_q[i, y] + dot(motion.spin_by_y[i], about_end)
            by_q[i, z] = by_q[i, z] + dot(motion.spin_by_z[i], about_end)
        yy, yz, zz = springs_of(segment, j)
        across = yz - torques.slope_across[j] + dot(motion.chord_yz[j], on_chord)
        by_q[y, y] = by_q[y, y] + yy - torques.slope[y] + dot(motion.chord_yy[j], on_chord)
        by_q[y, z] = by_q[y, z] + across
        by_q[z, y] = by_q[z, y] + across
        by_q[z, z] = by_q[z, z] + zz - torques.slope[z] + dot(motion.chord_zz[j], on_chord)
        by_rate[y, y] = by_rate[y, y] + segment.damping_yy
        by_rate[y, z] = by_rate[y, z] + segment.damping_yz
        by_rate[z, y] = by_rate[z, y] + segment.damping_yz
        by_rate[z, z] = by_rate[z, z] + segment.damping_zz
        for i in range(y, z + 1):
            half_2, half_1 = half_mass * motion.chord_2[i], segment.mass * motion.chord_1[i]
            angular_q[i] = angular_q[i] + cross(middle, half_2) + 0.5 * cross(posture.chord_by[i], own_force)
            linear_q[i] = linear_q[i] + half_2
            angular_rate[i] = angular_rate[i] + cross(middle, half_1)
            linear_rate[i] = linear_rate[i] + half_1
            for b in range(y):  # coordinates of segments nearer to the base
                w, move = posture.spin[b], posture.move[b]
                by_q[b, i] = dot(w, angular_q[i]) + dot(move, linear_q[i])
                by_rate[b, i] = dot(w, angular_rate[i]) + dot(move, linear_rate[i])
                carried = dot(momenta.angular[i], motion.spin_2[b]) + dot(momenta.linear[i], motion.move_2[b])
                by_q[i, b] = carried + dot(stretch_turned[i], motion.spin_1[b]) - dot(w, force_turned[i])
                carried = dot(momenta.angular[i], motion.spin_1[b]) + dot(momenta.linear[i], motion.move_1[b])
                by_rate[i, b] = 2.0 * carried + dot(stretch_turned[i], w)
        velocity = motion.velocity[j]
        beyond = gathered(beyond, segment.mass, middle)
        linear = linear + segment.mass * velocity
        circle = plus(circle, circling(middle, segment.mass * velocity))
        force = force + own_force
        moment = moment + cross(middle, own_force)
