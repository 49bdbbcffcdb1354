"""One-segment model of the wrist that model-based laws know (E6 with n = 1).

It is the model of `wrist.arcs` and `wrist.dynamics` written a second time, short enough for a law; tests hold one
against the other.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import bessel
from wristctl.lanes.lane import dot, planar, turn


@compiled
def one_segment_terms(wrist: Any, theta: Any) -> Any:
    """Inertia M, half its slope dM/d(theta)/2 (so that C = slope rate) and gravity G of the one-segment wrist.

    The chord's middle and the hand move along d = dp/d(theta) and bend by d' = d2p/d(theta)2, hence
    M = sum m d.d, C rate = sum m d.d' rate^2 and G = -sum m d.g, all in the chord's own frame.
    """
    x = 0.5 * theta
    e0, e1, e2, _ = bessel(x)
    s = x * x
    c = wrist.length * e0
    c1 = -0.5 * wrist.length * x * e1
    c2 = 0.25 * wrist.length * (s * e2 - e1)
    half_turn = planar(e0 - s * e1, x * e0)
    hand = wrist.hand_offset * half_turn
    chord = planar(c1, 0.5 * c)
    bent = planar(c2 - 0.25 * c, c1)
    along = chord + turn(hand)
    hand_bent = bent - hand
    inertia = 0.25 * wrist.mass * dot(chord, chord) + wrist.hand_mass * dot(along, along)
    curving = 0.25 * wrist.mass * dot(chord, bent) + wrist.hand_mass * dot(along, hand_bent)
    # gravity seen from the chord's frame: g turned back by the half turn
    weight = planar(
        dot(planar(wrist.gravity_x, wrist.gravity_y), half_turn),
        dot(planar(wrist.gravity_x, wrist.gravity_y), turn(half_turn)),
    )
    falling = dot(0.5 * wrist.mass * chord + wrist.hand_mass * along, weight)
    return inertia, curving, -falling


@compiled
def one_segment(wrist: Any, theta: Any, rate: Any) -> Any:
    """Inertia M and load (C + D) rate + G + K theta of the one-segment wrist, so that M theta'' + load = torque."""
    inertia, curving, gravity = one_segment_terms(wrist, theta)
    return inertia, curving * rate * rate + gravity + wrist.damping * rate + wrist.stiffness * theta


@compiled
def inverse_dynamics(wrist: Any, theta: Any, rate: Any, acceleration: Any) -> Any:
    """Torque [N m] under which the one-segment wrist moves like that."""
    inertia, load = one_segment(wrist, theta, rate)
    return inertia * acceleration + load
