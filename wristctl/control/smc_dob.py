"""Feedforward, PID, a disturbance observer and a sliding term: what the sliding term adds to `pid-dob`."""

from typing import Any

from wristctl.control.disturbance_observer import VALUES
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain, Surface
from wristctl.control.pid_dob import GAINS, rung
from wristctl.lanes.functions import tanh


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque of `pid-dob` less Ks tanh(s/phi), s = de/dt + Kp/Kd e.

    On the surface the PD term is nothing, so that the sliding term adds to it and has no slope of its own.
    """
    s = now.rate - now.rate_ref + gains.Kp / gains.Kd * (now.theta - now.theta_ref)
    return rung(now, wrist, gains, memory, gains.Ks * tanh(s / gains.phi))


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
        "hardware": {"Kp": 2.6, "Ki": 0.03, "Kd": 0.05, "wo": 200.0, "Ks": 0.02, "phi": 10.0},
    },
    memory=1 + VALUES,
    notes={"hardware": BY_TRIAL},
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
    surface=Surface(lambda gains: (gains["Kp"], gains["Kd"], 0.0), lambda gains: gains["Kd"] * gains["phi"]),
)
