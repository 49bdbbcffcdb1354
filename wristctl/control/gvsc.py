"""Geometric variable strain control: a wrist whose curvature varies along its length. The group's law is not printed.

Curvature kappa(u) = (theta + beta (2u - 1))/L over u = arc length / L, so the tangent turns by
phi(u) = theta u + beta (u^2 - u) and the tip by theta, whatever beta (Legendre order 1 of Renda's strain basis).
Stiffness and damping are diagonal: K, K/3 and D, D/3. A tendon parallel to the wrist pulls on theta alone.
"""

from typing import Any

from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import bessel
from wristctl.lanes.lane import dot, planar, turn, zero_like

# Gauss nodes on [0, 1], weights, and row after row the weights of the integrals from 0 to each node, correctly rounded:
# what LAPACK finds differs in its last bits from one processor to another.
_NODES = (
    0.046910077030668004, 0.23076534494715845, 0.5, 0.7692346550528415, 0.953089922969332,
)  # fmt: skip
_WEIGHTS = (
    0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324, 0.11846344252809454,
)  # fmt: skip
_PARTIAL = (
    0.05923172126404727, -0.019570364359076036, 0.011254400818642955, -0.005593793660812185, 0.0015881129678659985,
    0.12815100567004528, 0.11965716762484162, -0.0245921146196422, 0.010318280670683357, -0.002768994398769603,
    0.1137762880042246, 0.2600046516806415, 0.14222222222222222, -0.020690316430958283, 0.004687154523869941,
    0.12123243692686414, 0.22899605457899988, 0.30903655906408667, 0.11965716762484162, -0.009687563141950739,
    0.11687532956022854, 0.24490812891049543, 0.2731900436258015, 0.25888469960875926, 0.05923172126404727,
)  # fmt: skip
_COUNT = len(_NODES)


@compiled
def _tangent(theta: Any, beta: Any, u: Any) -> Any:
    x = 0.5 * (theta * u + beta * (u * u - u))
    e0, e1, _, _ = bessel(x)
    half_turn = planar(e0 - x * x * e1, x * e0)
    return half_turn * half_turn


@compiled
def strain_model(wrist: Any, theta: Any) -> Any:
    """Inertia, slope d(beta)/d(theta), static torque on theta, and beta, with beta at its own equilibrium.

    With mu(u) the mass beyond u, gravity's torques are -g . L int mu i u t du - g . m h i t(1) on theta and
    -g . L int mu i w t du on beta, w = u^2 - u, t the tangent; beta solves K/3 beta + torque = 0 by Newton's method.
    The inertia is that of the motion along theta with beta following.
    """
    zero = zero_like(theta)
    gravity = planar(wrist.gravity_x + zero, wrist.gravity_y + zero)
    beta = zero
    slope = zero
    torque = zero
    for _ in range(3):
        force, tangent_stiffness, coupling, torque = zero, zero, zero, zero
        for k in range(_COUNT):
            u = _NODES[k]
            w = u * u - u
            beyond = wrist.length * _WEIGHTS[k] * (wrist.mass * (1.0 - u) + wrist.hand_mass)
            t = _tangent(theta, beta, u)
            across, along = beyond * dot(gravity, turn(t)), beyond * dot(gravity, t)
            torque = torque - u * across
            force = force - w * across
            tangent_stiffness = tangent_stiffness + w * w * along
            coupling = coupling + u * w * along
        stiffness = wrist.stiffness / 3.0 + tangent_stiffness
        slope = -coupling / stiffness
        change = -(force + wrist.stiffness / 3.0 * beta) / stiffness
        beta = beta + change
        torque = torque + coupling * change
    end = _tangent(theta, zero, 1.0)
    hand = wrist.hand_offset * turn(end)
    torque = torque - wrist.hand_mass * dot(gravity, hand) + wrist.stiffness * theta

    inertia = zero
    tip = hand
    for i in range(_COUNT):
        place = planar(zero, zero)
        for k in range(_COUNT):
            u = _NODES[k]
            turning = (u + slope * (u * u - u)) * turn(_tangent(theta, beta, u))
            place = place + _PARTIAL[_COUNT * i + k] * wrist.length * turning
            if i == 0:
                tip = tip + _WEIGHTS[k] * wrist.length * turning
        inertia = inertia + _WEIGHTS[i] * wrist.mass * dot(place, place)
    return inertia + wrist.hand_mass * dot(tip, tip), slope, torque, beta


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + D (1 + slope^2/3) rate_ref + K theta_ref + G - Kp e - Kd de/dt (PD+, all terms at theta_ref).

    Spring and damper act as at the reference, so the wrist keeps its softness; the centrifugal torque, below 0.1 % of
    gravity's at 1 rad/s, is left out.
    """
    inertia, slope, static, _ = strain_model(wrist, now.theta_ref)
    damping = wrist.damping * (1.0 + slope * slope / 3.0)
    feedforward = inertia * now.acceleration_ref + damping * now.rate_ref + static
    return feedforward - gains.Kp * (now.theta - now.theta_ref) - gains.Kd * (now.rate - now.rate_ref)


GVSC = Controller(
    name="gvsc",
    law=law,
    source="our design after Renda et al., IEEE RA-L 5 (2020) 4006 (strain model); the paper names a GVSC only",
    gains={
        "Kp": Gain("N m/rad", "proportional gain", 1e-2, 1e4),
        "Kd": Gain("N m s/rad", "derivative gain", 1e-4, 1e2),
    },
    presets={"default": {"Kp": 10.0, "Kd": 0.3}, "hardware": {"Kp": 6.0, "Kd": 0.1}},
    notes={"default": "our design; chosen by trial on the four-segment plant at 1 kHz", "hardware": BY_TRIAL},
    conditions={"default": Conditions((1e-3, 1e-2), (2e4, 1e5)), "hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
