"""Dynamics of the n-segment wrist for arrays of lanes, as wristctl.wrist.dynamics and wristctl.wrist.jacobian."""

from __future__ import annotations

from typing import Any, NamedTuple

from equations import Segment, add, bessel, dot, mul, product, turn


class Posture(NamedTuple):
    """Chords and their derivatives, last tangent, tendon torque with its slope; lists over segments."""

    z: list[Any]
    dz: list[Any]
    d2z: list[Any]
    d3z: list[Any]
    tangent: Any
    pull: list[Any]
    slope: list[Any]


def posture(s: Segment, theta: list[Any], plus: Any, minus: Any) -> Posture:
    """What depends on the angles alone."""
    z, dz, d2z, d3z, pull, slope = [], [], [], [], [], []
    tangent: Any = (1.0, 0.0)
    bending, squeeze = s.tendon_offset * (plus - minus), 0.5 * s.length / s.spans * (plus + minus)
    for angle in theta:
        x = 0.5 * angle
        e0, e1, e2, e3, x2 = bessel(x)
        half = (e0 - x2 * e1, x * e0)
        direction = product(tangent, half)
        c, c1 = s.length * e0, -0.5 * s.length * x * e1
        c2, c3 = 0.25 * s.length * (x2 * e2 - e1), 0.125 * s.length * x * (3.0 * e2 - x2 * e3)
        z.append(mul(c, direction))
        dz.append(product((c1, 0.5 * c), direction))
        d2z.append(product((c2 - 0.25 * c, c1), direction))
        d3z.append(product((c3 - 0.75 * c1, 1.5 * c2 - 0.125 * c), direction))
        tangent = product(direction, half)
        y = x / s.spans
        e0, e1, e2, _, y2 = bessel(y)
        pull.append(bending * (e0 - y2 * e1) + squeeze * y * e1)
        slope.append(0.5 / s.spans * (squeeze * (e1 - y2 * e2) - bending * y * e0))
    return Posture(z, dz, d2z, d3z, tangent, pull, slope)


def mass_matrix(s: Segment, p: Posture) -> list[list[Any]]:
    """M of E6."""
    n, end = len(p.z), [p.z[0]]
    for z in p.z[1:]:
        end.append(add(end[-1], z))
    pivot = [add(e, turn(d)) for e, d in zip(end, p.dz, strict=True)]
    place = add(end[-1], mul(s.hand_offset, p.tangent))
    m0, m1, m2 = s.hand_mass, mul(s.hand_mass, place), s.hand_mass * dot(place, place)
    mass: list[list[Any]] = [[None] * n for _ in range(n)]
    for j in reversed(range(n)):
        middle, own = add(end[j], mul(-0.5, p.z[j])), mul(0.5 * s.mass, p.dz[j])
        mass[j][j] = m2 - 2.0 * dot(pivot[j], m1) + m0 * dot(pivot[j], pivot[j]) + 0.5 * dot(own, p.dz[j])
        for i in range(j):
            beyond = m2 - dot(add(pivot[i], pivot[j]), m1) + m0 * dot(pivot[i], pivot[j])
            mass[i][j] = mass[j][i] = beyond + dot(own, turn(add(middle, mul(-1.0, pivot[i]))))
        m0, m1, m2 = m0 + s.mass, add(m1, mul(s.mass, middle)), m2 + s.mass * dot(middle, middle)
    return mass


def bias(s: Segment, theta: list[Any], omega: list[Any], p: Posture) -> list[Any]:
    """Remaining terms of E6: M theta'' + bias = 0."""
    n, force, a, spin = len(theta), [], (0.0, 0.0), 0.0
    weight = (s.gravity_x, s.gravity_y)
    for k, w in enumerate(omega):
        bent = mul(w * w, p.d2z[k])
        if k > 0:  # the base does not turn
            bent = add(bent, mul(2.0 * spin * w, turn(p.dz[k])), mul(-spin * spin, p.z[k]))
        force.append(mul(s.mass, add(a, mul(0.5, bent), mul(-1.0, weight))))
        a, spin = add(a, bent), spin + w
    hand = mul(s.hand_offset, p.tangent)
    beyond = mul(s.hand_mass, add(a, mul(-spin * spin, hand), mul(-1.0, weight)))
    torque = dot(turn(hand), beyond)
    beyond = add(beyond, (-s.force_x, -s.force_y))
    r: list[Any] = [None] * n
    for k in reversed(range(n)):
        on = add(beyond, mul(0.5, force[k]))
        r[k] = torque + dot(p.dz[k], on) + s.stiffness * theta[k] + s.damping * omega[k] - p.pull[k]
        torque, beyond = torque + dot(turn(p.z[k]), on), add(beyond, force[k])
    return r


def jacobians(s: Segment, omega: list[Any], acceleration: list[Any], at: Posture) -> Any:
    """dr/d(theta) and dr/d(rate) at the given accelerations."""
    z, dz, d2z, d3z = at[:4]
    n, spin, spin_rate = len(z), 0.0, 0.0
    p, v, a, weight = (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (-s.gravity_x, -s.gravity_y)
    pivot, middle, velocity, force, field, sweep, own_field, own_sweep = ([] for _ in range(8))
    for k, w in enumerate(omega):
        rate, own_turn = mul(w, dz[k]), mul(w, d2z[k])
        bent = add(mul(acceleration[k], dz[k]), mul(w * w, d2z[k]))
        own_bend = add(mul(acceleration[k], d2z[k]), mul(w * w, d3z[k]))
        if k > 0:  # the base does not turn
            turning, across = (-spin * spin, spin_rate), 2.0 * spin * w
            rate, own_turn = add(rate, mul(spin, turn(z[k]))), add(own_turn, mul(spin, turn(dz[k])))
            bent = add(bent, product(turning, z[k]), mul(across, turn(dz[k])))
            own_bend = add(own_bend, product(turning, dz[k]), mul(across, turn(d2z[k])))
        own_field.append(own_bend)
        own_sweep.append(own_turn)
        middle.append(add(p, mul(0.5, z[k])))
        velocity.append(add(v, mul(0.5, rate)))
        force.append(mul(s.mass, add(a, mul(0.5, bent), weight)))
        p, v, a = add(p, z[k]), add(v, rate), add(a, bent)
        pivot.append(add(p, turn(dz[k])))
        field.append(add(own_field[k], mul(-1.0, turn(add(a, weight)))))
        sweep.append(add(own_sweep[k], mul(-1.0, turn(v))))
        spin, spin_rate = spin + w, spin_rate + acceleration[k]
    hand = mul(s.hand_offset, at.tangent)
    place, load = add(p, hand), (s.force_x, s.force_y)
    m0, m1, momentum = s.hand_mass, mul(s.hand_mass, place), mul(s.hand_mass, add(v, mul(spin, turn(hand))))
    stretch = dot(place, momentum)
    beyond = add(mul(m0, add(a, product((-spin * spin, spin_rate), hand), weight)), mul(-1.0, load))
    tip = [dot(add(p, mul(-1.0, q)), load) for q in pivot]
    by_theta: list[list[Any]] = [[None] * n for _ in range(n)]
    by_rate: list[list[Any]] = [[None] * n for _ in range(n)]
    for j in reversed(range(n)):
        half, own = mul(0.5, dz[j]), mul(0.5 * s.mass, dz[j])
        moment_j = turn(add(m1, mul(-m0, pivot[j])))
        whole, turned_j = add(moment_j, own), stretch - dot(pivot[j], momentum)
        circling = turned_j + dot(own, turn(velocity[j]))
        for i in range(j):
            by_theta[j][i] = dot(whole, field[i]) + tip[j]
            by_rate[j][i] = 2.0 * (circling + dot(whole, sweep[i]))
            moment = turn(add(m1, mul(-m0, pivot[i])))
            reach = mul(0.5 * s.mass, turn(add(middle[j], mul(-1.0, pivot[i]))))
            shifted = dot(add(pivot[j], mul(-1.0, pivot[i])), beyond) + dot(turn(half), force[j])
            by_theta[i][j] = shifted + dot(moment, field[j]) + dot(reach, own_field[j]) + tip[i]
            turned = stretch - dot(pivot[i], momentum)
            by_rate[i][j] = 2.0 * (turned + dot(moment, sweep[j]) + dot(reach, own_sweep[j]))
        curved = dot(d2z[j], add(beyond, mul(0.5, force[j]))) - dot(turn(dz[j]), beyond)
        inertial = dot(moment_j, field[j]) + 0.5 * dot(own, own_field[j]) + tip[j]
        by_theta[j][j] = curved + inertial + s.stiffness - at.slope[j]
        by_rate[j][j] = 2.0 * (turned_j + dot(moment_j, sweep[j]) + 0.5 * dot(own, own_sweep[j])) + s.damping
        m0, m1 = m0 + s.mass, add(m1, mul(s.mass, middle[j]))
        stretch = stretch + s.mass * dot(middle[j], velocity[j])
        momentum, beyond = add(momentum, mul(s.mass, velocity[j])), add(beyond, force[j])
    return by_theta, by_rate
