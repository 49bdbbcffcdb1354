"""Computed torque: the one-segment model cancelled exactly, and a linear error equation in its place."""

from typing import Any

from wristctl.control.law import Conditions, Controller, Gain
from wristctl.control.model import one_segment


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M (theta_ref'' - 2 zeta w de/dt - w^2 e) + load (Spong, Hutchinson and Vidyasagar 2006, section 8.3)."""
    frequency, damping_ratio = gains.w, gains.zeta
    inertia, load = one_segment(wrist, now.theta, now.rate)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    wanted = now.acceleration_ref - frequency * (2.0 * damping_ratio * error_rate + frequency * error)
    return inertia * wanted + load


COMPUTED_TORQUE = Controller(
    name="computed-torque",
    law=law,
    source="baseline",
    gains={
        "w": Gain("rad/s", "natural frequency of the error", 1e-1, 1e5),
        "zeta": Gain("", "damping ratio of the error", 1e-3, 1e3),
    },
    presets={"default": {"w": 50.0, "zeta": 1.0}},
    conditions={"default": Conditions((1e-3, 1e-2), (8e3, 1e5))},
)
