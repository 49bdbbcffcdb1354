"""Linear quadratic control with an integral: feedforward, and the optimal feedback of the wrist's linear model."""

from typing import Any

from wristctl.control.clamped_integral import held, integrated
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import inverse_dynamics, one_segment_terms
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import sqrt

_ITERATIONS = 24


@compiled
def spectral_factor(damping: Any, stiffness: Any, wd: Any, wp: Any, wi: Any) -> Any:
    """p1 and p2 of the closed loop s^3 + p2 s^2 + p1 s + wi^3 that is optimal for weights wi^6, wp^4 and wd^2.

    It is that of e'' + d e' + k e = a with the cost int a^2 + wd^2 e'^2 + wp^4 e^2 + wi^6 (int e)^2: comparing
    p(s) p(-s) with that of the open loop and the weights, power by power (Kwakernaak and Sivan 1972, section 3.8),
    gives p2^2 = d^2 - 2 k + wd^2 + 2 p1 and p1^2 = k^2 + wp^4 + 2 p2 wi^3. Taken by turns these converge,
    by wi^3/(p1 p2) a turn, which is below 1 by Routh's condition of the loop that they end at.
    """
    wi3, wp2 = wi * wi * wi, wp * wp
    least = damping * damping - 2.0 * stiffness + wd * wd
    first = abs(stiffness) + wp2 + 2.0 * wi * wi
    second = damping + wd + 2.0 * (wp + wi)
    for _ in range(_ITERATIONS):
        first = sqrt(stiffness * stiffness + wp2 * wp2 + 2.0 * second * wi3)
        second = sqrt(least + 2.0 * first)
    return first, second


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - M ((p1 - k) e + (p2 - d) de/dt + wi^3 int(e)), k = K/M and d = D/M.

    M is the inertia at the present angle (gain scheduling); spring and damper of the wrist stay in the loop and are
    used, where computed torque cancels them. Behind a camera its state is the shared Kalman filter's.
    """
    inertia, _, _ = one_segment_terms(wrist, now.theta)
    stiffness, damping = wrist.stiffness / inertia, wrist.damping / inertia
    first, second = spectral_factor(damping, stiffness, gains.wd, gains.wp, gains.wi)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    integral = integrated(now, memory[0])
    feedback = (first - stiffness) * error + (second - damping) * error_rate + gains.wi * gains.wi * gains.wi * integral
    fed_forward = inverse_dynamics(wrist, now.theta_ref, now.rate_ref, now.acceleration_ref)
    torque = fed_forward - inertia * feedback
    memory[0] = held(now, torque, memory[0], integral)
    return torque


LQI = Controller(
    name="lqi",
    law=law,
    source="Kwakernaak and Sivan, Linear Optimal Control Systems (1972), sections 3.7 and 3.8",
    gains={
        "wp": Gain("rad/s", "weight of the error, wp^4 beside the acceleration's 1", 1e-2, 1e4),
        "wd": Gain("rad/s", "weight of its rate, wd^2", 1e-2, 1e4),
        "wi": Gain("rad/s", "weight of its integral, wi^6", 1e-2, 1e4),
    },
    presets={
        "default": {"wp": 40.0, "wd": 40.0, "wi": 15.0},
        "hardware": {"wp": 40.0, "wd": 40.0, "wi": 30.0},
    },
    memory=1,
    notes={"hardware": BY_TRIAL},
    conditions={"default": Conditions((1e-3, 1e-2), (8e3, 1e5)), "hardware": Conditions((1e-3, 1e-2), (8e3, 1e5))},
)
