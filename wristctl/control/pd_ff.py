"""Feedforward and PD: the first rung of feedback above `feedforward`."""

from typing import Any

from wristctl.control.law import BY_STUDY, Conditions, Controller, Gain
from wristctl.control.model import inverse_dynamics
from wristctl.lanes.compiled import compiled

GAINS = {
    "Kp": Gain("N m/rad", "proportional gain", 1e-2, 1e4),
    "Kd": Gain("N m s/rad", "derivative gain", 1e-4, 1e2),
}


@compiled
def fed_forward_pd(now: Any, wrist: Any, gains: Any) -> Any:
    """The torque that the reference's motion asks of the model, less Kp e + Kd de/dt."""
    fed_forward = inverse_dynamics(wrist, now.theta_ref, now.rate_ref, now.acceleration_ref)
    return fed_forward - gains.Kp * (now.theta - now.theta_ref) - gains.Kd * (now.rate - now.rate_ref)


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - Kp e - Kd de/dt."""
    return fed_forward_pd(now, wrist, gains)


PD_FF = Controller(
    name="pd-ff",
    law=law,
    source="baseline: what PD adds to feedforward",
    gains=GAINS,
    presets={
        "default": {"Kp": 1.0, "Kd": 0.1},
        "hardware": {"Kp": 7.0, "Kd": 4e-4},
    },
    notes={"hardware": BY_STUDY},
    conditions={"default": Conditions((1e-3, 1e-2), (8e3, 1e5)), "hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
