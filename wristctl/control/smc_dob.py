"""Feedforward, PID, a disturbance observer and a sliding term: what the sliding term adds to `pid-dob`."""

from __future__ import annotations

from typing import Any

from wristctl.control import pid_ff
from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import Conditions, Controller, Gain, Surface
from wristctl.control.pd_ff import fed_forward_pd
from wristctl.control.pid_dob import GAINS
from wristctl.lanes.functions import tanh


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque of `pid-dob` less Ks tanh(s/phi), s = de/dt + Kp/Kd e.

    On the surface the PD term is nothing, so that the sliding term adds to it and has no slope of its own.
    """
    found = disturbance(now, wrist, gains.wo, memory, 1)
    integral = pid_ff.integrated(now, memory[0])
    s = now.rate - now.rate_ref + gains.Kp / gains.Kd * (now.theta - now.theta_ref)
    torque = fed_forward_pd(now, wrist, gains) - gains.Ki * integral - found - gains.Ks * tanh(s / gains.phi)
    memory[0] = pid_ff.held(now, torque, memory[0], integral)
    remember(now, wrist, found, torque, memory, 1)
    return torque


SMC_DOB = Controller(
    name="smc-dob",
    law=law,
    source="baseline: what a sliding term (Slotine and Li 1991, section 7.2) adds to pid-dob",
    gains=GAINS
    | {
        "Ks": Gain("N m", "torque of the sliding term", 1e-4, 1e2),
        "phi": Gain("rad/s", "width of the boundary layer", 1e-2, 1e4),
    },
    presets={
        "default": {"Kp": 5.0, "Ki": 1.0, "Kd": 0.2, "wo": 20.0, "Ks": 0.05, "phi": 1.0},
        "stepper": {"Kp": 4.0, "Ki": 1.0, "Kd": 0.1, "wo": 200.0, "Ks": 0.02, "phi": 1.0},
    },
    memory=1 + VALUES,
    notes={"stepper": "behind a 60 Hz camera, steppers and tendons of 8 to 100 kN/m: by a sweep over docs/margins.py"},
    conditions={"stepper": Conditions((5e-3, 1e-2), (8e3, 1e5))},
    surface=Surface(lambda gains: (gains["Kp"], gains["Kd"], 0.0), lambda gains: gains["Kd"] * gains["phi"]),
)
