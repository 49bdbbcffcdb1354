"""Feedforward, PID and a disturbance observer: what such an observer adds to `pid-ff`."""

from typing import Any

from wristctl.control import pid_ff
from wristctl.control.clamped_integral import held, integrated
from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.pd_ff import fed_forward_pd
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import zero_like

GAINS = pid_ff.GAINS | {"wo": Gain("rad/s", "bandwidth of the disturbance observer", 1e-1, 1e5)}


@compiled
def rung(now: Any, wrist: Any, gains: Any, memory: Any, more: Any) -> Any:
    """The law's torque less `more` [N m], what the rung above adds."""
    load = disturbance(now, wrist, gains.wo, memory, 1)
    integral = integrated(now, memory[0])
    torque = fed_forward_pd(now, wrist, gains) - gains.Ki * integral - load - more
    memory[0] = held(now, torque, memory[0], integral)
    remember(now, wrist, load, torque, memory, 1)
    return torque


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - Kp e - Ki int(e) - Kd de/dt - d."""
    return rung(now, wrist, gains, memory, zero_like(now.theta))


PID_DOB = Controller(
    name="pid-dob",
    law=law,
    source="baseline: what a disturbance observer adds to pid-ff",
    gains=GAINS,
    presets={
        "default": {"Kp": 5.0, "Ki": 1.0, "Kd": 0.2, "wo": 20.0},
        "hardware": {"Kp": 2.6, "Ki": 0.03, "Kd": 0.02, "wo": 150.0},
    },
    memory=1 + VALUES,
    notes={"hardware": BY_TRIAL},
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
