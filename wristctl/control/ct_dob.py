"""Computed torque with a disturbance observer: the model cancelled, and what it lacks measured and cancelled too."""

from typing import Any

from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import one_segment


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M (theta_ref'' - 2 zeta w de/dt - w^2 e) + load - d, d the load torque that the momentum shows.

    A load that does not change leaves no error; one that changes slower than wo leaves little. What saturation keeps
    from the wrist is no load: nothing winds up.
    """
    frequency, damping_ratio = gains.w, gains.zeta
    unmodelled = disturbance(now, wrist, gains.wo, memory, 0)
    inertia, load = one_segment(wrist, now.theta, now.rate)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    wanted = now.acceleration_ref - frequency * (2.0 * damping_ratio * error_rate + frequency * error)
    torque = inertia * wanted + load - unmodelled
    remember(now, wrist, unmodelled, torque, memory, 0)
    return torque


CT_DOB = Controller(
    name="ct-dob",
    law=law,
    source="Ohnishi, Shibata and Murakami, IEEE/ASME Trans. Mechatronics 1 (1996) 54, on computed torque",
    gains={
        "w": Gain("rad/s", "natural frequency of the error", 1e-1, 1e5),
        "zeta": Gain("", "damping ratio of the error", 1e-3, 1e3),
        "wo": Gain("rad/s", "bandwidth of the disturbance observer", 1e-1, 1e5),
    },
    presets={
        "default": {"w": 50.0, "zeta": 1.0, "wo": 50.0},
        "hardware": {"w": 35.0, "zeta": 0.6, "wo": 300.0},
    },
    memory=VALUES,
    notes={"hardware": BY_TRIAL},
    conditions={"default": Conditions((5e-3, 1e-2), (2e4, 1e5)), "hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
