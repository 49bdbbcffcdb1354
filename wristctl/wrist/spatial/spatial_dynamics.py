"""The fast form of the dynamics in two planes: M and the remaining terms, in the ground's axes, in O(n^2).

The masses are the planar wrist's: points at the chords' middles, and the hand on the last tangent. All that lies beyond
a segment moves by the screw (w, v) of each of its coordinates (`posture`), so that the mass, first moment and inertia
of what lies beyond, about the origin, give its momentum under one coordinate, and that momentum's product with another
coordinate's screw the entry of M. The motion obeys M q'' + r = 0, r = bias + D q' + K q - tendons' torque.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled, spelled_out
from wristctl.lanes.lane import dot, zero_like
from wristctl.lanes.space import cross, space, spaces_like
from wristctl.wrist.spatial.posture import bend_segments, posture_like, series_of
from wristctl.wrist.spatial.spatial_chain import chord_of, chord_unit, springs_of
from wristctl.wrist.spatial.spatial_tendons import tendons_torques, torques_like
from wristctl.wrist.spatial.stumpff import slopes


class Tensor(NamedTuple):
    """A 3 x 3 matrix by its rows."""

    x: Any
    y: Any
    z: Any


class Bulk(NamedTuple):
    """Point masses as one: their mass, first moment, and inertia about the origin."""

    mass: Any
    moment: Any
    inertia: Any


class Momenta(NamedTuple):
    """Momentum of all that a coordinate moves, when it moves at 1 rad/s: about the origin, and linear; a row each."""

    angular: Any
    linear: Any


@compiled
def gravity_of(segment: Any) -> Any:
    """Gravity [m/s^2]."""
    return space(segment.gravity_x, segment.gravity_y, segment.gravity_z)


@compiled
def force_of(segment: Any) -> Any:
    """Force on the last disc's centre [N]."""
    return space(segment.force_x, segment.force_y, segment.force_z)


@compiled
def circling(x: Any, p: Any) -> Any:
    """The matrix (x.p) 1 - x p^T: of p = m x the inertia of a mass, w -> x x (w x p)."""
    xx, yy, zz = x.x * p.x, x.y * p.y, x.z * p.z
    return Tensor(
        space(yy + zz, -(x.x * p.y), -(x.x * p.z)),
        space(-(x.y * p.x), xx + zz, -(x.y * p.z)),
        space(-(x.z * p.x), -(x.z * p.y), xx + yy),
    )


@compiled
def plus(a: Any, b: Any) -> Any:
    """Sum of two tensors."""
    return Tensor(a.x + b.x, a.y + b.y, a.z + b.z)


@compiled
def times(tensor: Any, v: Any) -> Any:
    """Tensor times vector."""
    return space(dot(tensor.x, v), dot(tensor.y, v), dot(tensor.z, v))


@compiled
def bulk_of(mass: Any, place: Any) -> Any:
    """A point mass as Bulk."""
    moment = mass * place
    return Bulk(mass, moment, circling(place, moment))


@compiled
def gathered(bulk: Any, mass: Any, place: Any) -> Any:
    """The bulk with one more point mass."""
    moment = mass * place
    return Bulk(bulk.mass + mass, bulk.moment + moment, plus(bulk.inertia, circling(place, moment)))


@compiled
def momentum(bulk: Any, spin: Any, move: Any) -> Any:
    """Momentum of a bulk that moves by a screw: about the origin, and linear."""
    return times(bulk.inertia, spin) + cross(bulk.moment, move), bulk.mass * move - cross(bulk.moment, spin)


@compiled
def spatial_mass_matrix(segment: Any, posture: Any, tangent: Any, mass: Any, momenta: Any) -> None:
    """M = sum m J^T J into `mass`, and the Momenta of what each coordinate moves, its half chord's included."""
    n = len(posture.chord)
    half_mass = 0.5 * segment.mass
    beyond = bulk_of(segment.hand_mass, posture.end[n - 1] + segment.hand_offset * tangent)
    for j in range(n - 1, -1, -1):
        middle = posture.end[j] - 0.5 * posture.chord[j]
        for a in range(2 * j, 2 * j + 2):
            angular, linear = momentum(beyond, posture.spin[a], posture.move[a])
            half_chord = half_mass * posture.chord_by[a]
            for b in range(2 * j, a + 1):
                own = dot(posture.spin[b], angular) + dot(posture.move[b], linear)
                mass[a, b] = own + 0.5 * dot(half_chord, posture.chord_by[b])
                mass[b, a] = mass[a, b]
            angular, linear = angular + cross(middle, half_chord), linear + half_chord
            momenta.angular[a] = angular
            momenta.linear[a] = linear
            for b in range(2 * j):
                mass[a, b] = dot(posture.spin[b], angular) + dot(posture.move[b], linear)
                mass[b, a] = mass[a, b]
        beyond = gathered(beyond, segment.mass, middle)


@compiled
def by_plane(yy: Any, yz: Any, zz: Any, pairs: Any, k: int) -> Any:
    """A symmetric matrix times the segment's pair (y, z)."""
    y, z = pairs[2 * k], pairs[2 * k + 1]
    return yy * y + yz * z, yz * y + zz * z


@compiled
def spatial_bias(segment: Any, q: Any, rate: Any, posture: Any, tangent: Any, torque: Any, r: Any) -> None:
    """r at q'' = 0, so that M q'' + bias = r, by Newton and Euler: forces outward to the tip, torques back.

    `torque` holds the tendons' torque on each coordinate.
    """
    n, length = len(posture.chord), chord_unit(segment)
    force = spaces_like(posture.chord)
    zero, weight = zero_like(length), gravity_of(segment)
    a, spin, spin_rate = space(zero, zero, zero), space(zero, zero, zero), space(zero, zero, zero)
    for k in range(n):
        y, z = 2 * k, 2 * k + 1
        c = series_of(posture, k)
        d = slopes(c)
        part = chord_of(segment, c)
        along = q[y] * rate[y] + q[z] * rate[z]
        speed, along_2 = rate[y] * rate[y] + rate[z] * rate[z], along * along
        turning = rate[y] * posture.normal[y] + rate[z] * posture.normal[z]
        bent = (length * (part.along_2 * along_2 + part.along_1 * speed)) * posture.tangent[k]
        bent = bent + (length * (part.lean_1 * speed + part.lean_2 * along_2)) * posture.bend[k]
        bent = bent + (2.0 * length * part.lean_1 * along) * turning
        by_rate, by_bend = (d.d1 + c.c3) * along, d.d3 * along_2 + c.c3 * speed
        twist = d.d2 * along * (q[y] * rate[z] - q[z] * rate[y])
        turned = twist * posture.tangent[k]
        turned = turned + (by_rate * rate[y] + by_bend * q[y]) * posture.axis[y]
        turned = turned + (by_rate * rate[z] + by_bend * q[z]) * posture.axis[z]
        spun = rate[y] * posture.spin[y] + rate[z] * posture.spin[z]
        if k > 0:  # the base does not turn
            swept = rate[y] * posture.chord_by[y] + rate[z] * posture.chord_by[z]
            chord = posture.chord[k]
            bent = bent + cross(spin_rate, chord) + cross(spin, cross(spin, chord) + 2.0 * swept)
            turned = turned + cross(spin, spun)
        force[k] = segment.mass * (a + 0.5 * bent - weight)
        a = a + bent
        spin_rate = spin_rate + turned
        spin = spin + spun
    hand = segment.hand_offset * tangent
    beyond = segment.hand_mass * (a + cross(spin_rate, hand) + cross(spin, cross(spin, hand)) - weight)
    moment = cross(hand, beyond)
    beyond = beyond - force_of(segment)
    for k in range(n - 1, -1, -1):
        on_chord = beyond + 0.5 * force[k]
        yy, yz, zz = springs_of(segment, k)
        spring_y, spring_z = by_plane(yy, yz, zz, q, k)
        damper_y, damper_z = by_plane(segment.damping_yy, segment.damping_yz, segment.damping_zz, rate, k)
        r[2 * k] = spring_y + damper_y
        r[2 * k + 1] = spring_z + damper_z
        for i in range(2 * k, 2 * k + 2):
            r[i] = r[i] + dot(posture.spin[i], moment) + dot(posture.chord_by[i], on_chord) - torque[i]
        moment = moment + cross(posture.chord[k], on_chord)
        beyond = beyond + force[k]


@spelled_out
def momenta_like(q: Any) -> Any:
    """Memory for the Momenta of coordinates q."""
    return Momenta(spaces_like(q), spaces_like(q))


class BentWrist(NamedTuple):
    """A wrist as it is bent and pulled: its posture with the last tangent, Momenta, and TendonTorques."""

    posture: Any
    tangent: Any
    momenta: Any
    torques: Any


@spelled_out
def bent_wrist(wrist: Any, q: Any, pulls: Any, mass: Any) -> Any:
    """The wrist at coordinates q under pulls [N] of each tendon; M into `mass`."""
    posture, torques, momenta = posture_like(q), torques_like(q), momenta_like(q)
    tangent, _, _ = bend_segments(wrist.segment, q, posture)
    tendons_torques(wrist, q, pulls, torques)
    spatial_mass_matrix(wrist.segment, posture, tangent, mass, momenta)
    return BentWrist(posture, tangent, momenta, torques)


@compiled
def spatial_equation(wrist: Any, q: Any, rate: Any, pulls: Any, mass: Any, r: Any) -> None:
    """M and the remaining terms, so that M q'' + r = 0 under pulls [N] of each tendon."""
    bent = bent_wrist(wrist, q, pulls, mass)
    spatial_bias(wrist.segment, q, rate, bent.posture, bent.tangent, bent.torques.torque, r)
