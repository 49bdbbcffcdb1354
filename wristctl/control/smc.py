"""The paper's sliding mode controller, E12-E21."""

from typing import Any

from wristctl.control.law import Conditions, Controller, Gain, Surface
from wristctl.control.model import one_segment
from wristctl.lanes.functions import tanh


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """U = -(L_f sigma + P3 tanh(sigma)) / L_g sigma on sigma = P1 e + P2 rate, with e = theta - theta_ref (E12-E20).

    L_f sigma = P1 rate - P2 load / M and L_g sigma = P2 / M. As printed the law uses the rate itself, not the rate
    of e (C9): on a moving reference it lags.
    """
    p1, p2, p3 = gains.P1, gains.P2, gains.P3
    inertia, load = one_segment(wrist, now.theta, now.rate)
    sigma = p1 * (now.theta - now.theta_ref) + p2 * now.rate
    return load - inertia / p2 * (p1 * now.rate + p3 * tanh(sigma))


SMC = Controller(
    name="smc",
    law=law,
    source="the paper, E12-E21",
    gains={
        "P1": Gain("1/rad", "weight of the error in sigma", 1e-3, 1e3),
        "P2": Gain("s/rad", "weight of the rate in sigma", 1e-3, 1e3),
        "P3": Gain("1/s", "reaching gain", 1e-1, 1e5),
    },
    presets={
        "printed": {"P1": 0.001, "P2": 1000.0, "P3": 1000.0},
        "exchanged": {"P1": 1000.0, "P2": 0.001, "P3": 1000.0},
        "initial": {"P1": 1.0, "P2": 1.0, "P3": 1.0},
        "hardware": {"P1": 20.0, "P2": 1.0, "P3": 60.0},
    },
    notes={
        "printed": "on sigma = 0 the angle has a time constant of P2/P1 = 1e6 s (C5)",
        "exchanged": "hypothesis: P1 and P2 of the printed gains exchanged (C5)",
        "initial": "the paper's start values",
        "hardware": "behind a camera and stepper motors at a period of 5 ms: chosen by trial on the emulated bench",
    },
    conditions={
        "printed": Conditions((1e-3, 1e-2), (2e3, 1e5)),
        "initial": Conditions((1e-3, 1e-2), (5e3, 1e5)),
        "hardware": Conditions((1e-3, 1e-2), (5e3, 1e5)),
    },
    surface=Surface(lambda gains: (gains["P1"], gains["P2"], 0.0), lambda gains: 1.0, of_error=False),
)
