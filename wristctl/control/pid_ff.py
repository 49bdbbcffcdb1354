"""Feedforward and PID: what an integral adds to `pd-ff`."""

from typing import Any

from wristctl.control import pd_ff
from wristctl.control.clamped_integral import held, integrated
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain

GAINS = pd_ff.GAINS | {"Ki": Gain("N m/(rad s)", "integral gain", 1e-2, 1e4)}


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - Kp e - Ki int(e) - Kd de/dt, held in saturation."""
    integral = integrated(now, memory[0])
    torque = pd_ff.fed_forward_pd(now, wrist, gains) - gains.Ki * integral
    memory[0] = held(now, torque, memory[0], integral)
    return torque


PID_FF = Controller(
    name="pid-ff",
    law=law,
    source="baseline: what an integral adds to pd-ff",
    gains=GAINS,
    presets={
        "default": {"Kp": 1.0, "Ki": 5.0, "Kd": 0.1},
        "hardware": {"Kp": 5.0, "Ki": 60.0, "Kd": 0.1},
    },
    memory=1,
    notes={"hardware": BY_TRIAL},
    conditions={"default": Conditions((1e-3, 1e-2), (8e3, 1e5)), "hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
