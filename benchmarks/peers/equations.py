"""The wrist's closed loop written for arrays of lanes, [lane] each, loops over segments unrolled: NumPy or JAX.

The same formulas, law and RODAS3 step as wristctl's kernel, with x and y of planar vectors as complex numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from wristctl.lanes.series import E2, E3


class Segment(NamedTuple):
    """Parameters of the wrist's segments, as wristctl.wrist.segments.Segments; SI units."""

    length: Any
    mass: Any
    hand_mass: Any
    hand_offset: Any
    gravity_x: Any
    gravity_y: Any
    tendon_offset: Any
    spans: Any
    stiffness: Any
    damping: Any
    force_x: Any
    force_y: Any


def polynomial(coefficients: Sequence[float], x: Any) -> Any:
    """The value at x by Horner's scheme, coefficients lowest power first."""
    *rest, total = coefficients
    for coefficient in reversed(rest):
        total = total * x + coefficient
    return total


def bessel(x: Any) -> Any:
    """j_n(x)/x^n for n = 0..3, and x^2."""
    s = x * x
    e2, e3 = polynomial(E2, s), polynomial(E3, s)
    e1 = 5.0 * e2 - s * e3
    return 3.0 * e1 - s * e2, e1, e2, e3, s


def dot(u: Any, v: Any) -> Any:
    """Inner product of planar vectors (real, imaginary)."""
    return u[0] * v[0] + u[1] * v[1]


def add(*vectors: Any) -> Any:
    """Sum of planar vectors."""
    return sum(v[0] for v in vectors), sum(v[1] for v in vectors)


def mul(s: Any, v: Any) -> Any:
    """Scaled planar vector."""
    return s * v[0], s * v[1]


def product(u: Any, v: Any) -> Any:
    """Product as complex numbers."""
    return u[0] * v[0] - u[1] * v[1], u[0] * v[1] + u[1] * v[0]


def turn(v: Any) -> Any:
    """Turned by +90 degrees."""
    return -v[1], v[0]


def arms(theta: Any, s: Segment) -> Any:
    """Moment arms of both sides [m]."""
    y = 0.5 * theta / s.spans
    e0, e1, _, _, y2 = bessel(y)
    bending, squeeze = s.tendon_offset * (e0 - y2 * e1), 0.5 * s.length / s.spans * y * e1
    return bending + squeeze, squeeze - bending


def one_segment(s: Segment, theta: Any, rate: Any) -> Any:
    """Inertia and load of the controller's model."""
    x = 0.5 * theta
    e0, e1, e2, _, x2 = bessel(x)
    c, c1, c2 = s.length * e0, -0.5 * s.length * x * e1, 0.25 * s.length * (x2 * e2 - e1)
    half = (e0 - x2 * e1, x * e0)
    hand, chord, bent = mul(s.hand_offset, half), (c1, 0.5 * c), (c2 - 0.25 * c, c1)
    along, hand_bent = add(chord, turn(hand)), add(bent, mul(-1.0, hand))
    inertia = 0.25 * s.mass * dot(chord, chord) + s.hand_mass * dot(along, along)
    curving = 0.25 * s.mass * dot(chord, bent) + s.hand_mass * dot(along, hand_bent)
    g = (s.gravity_x, s.gravity_y)
    falling = dot(add(mul(0.5 * s.mass, chord), mul(s.hand_mass, along)), (dot(g, half), dot(g, turn(half))))
    return inertia, curving * rate * rate - falling + s.damping * rate + s.stiffness * theta


def sliding_mode(xp: Any, model: Segment, gains: Any, theta: Any, rate: Any, theta_ref: Any) -> Any:
    """Torque that the sliding mode law wants [N m]."""
    inertia, load = one_segment(model, theta, rate)
    sigma = gains[0] * (theta - theta_ref) + gains[1] * rate
    return load - inertia / gains[1] * (gains[0] * rate + gains[2] * xp.tanh(sigma))


def pulls(xp: Any, model: Segment, gains: Any, low: Any, high: Any, theta: Any, rate: Any, theta_ref: Any) -> Any:
    """The sliding mode law and its tension pair: pulls of the + and the - side [N]."""
    wanted = sliding_mode(xp, model, gains, theta, rate, theta_ref)
    plus, minus = arms(theta, model)
    forward = wanted > (plus + minus) * low
    pull_plus = xp.where(forward, (wanted - minus * low) / plus, low)
    pull_minus = xp.where(forward, low, (wanted - plus * low) / minus)
    return xp.clip(pull_plus, low, high), xp.clip(pull_minus, low, high)


def torque(model: Segment, theta: Any, plus: Any, minus: Any) -> Any:
    """Torque of both pulls on the one-segment wrist [N m]."""
    arm_plus, arm_minus = arms(theta, model)
    return arm_plus * plus + arm_minus * minus
