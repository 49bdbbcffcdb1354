"""Super-twisting: a second-order sliding mode whose torque is continuous."""

from typing import Any

from wristctl.control.clamped_integral import delivered
from wristctl.control.law import Conditions, Controller, Gain, Surface
from wristctl.control.model import one_segment
from wristctl.lanes.lane import sqrt, where


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """Torque that makes s' = -k1 r(s) + v, v' = -2 k2 r(s) r'(s) on s = de/dt + lambda e, with the model cancelled.

    r(s) = sgn(s) x, where x solves x^2 + k1 tau x = |s|. With tau = 0, r is the signed root and the law is Levant's,
    s' = -k1 sqrt(|s|) sgn(s) + v, v' = -k2 sgn(s): the jump sits in v', so the torque is continuous, and a model error
    whose acceleration changes slower than k2 is met exactly after a finite time. tau bounds the slope k1 r'(0) = 1/tau,
    which sampling and the wrist's fast modes need; r and r r' are a pair of Moreno's generalised form, whose Lyapunov
    function holds for every such r. Reaching is finite to |s| of about (k1 tau)^2, exponential within. v holds while a
    tendon saturates.
    """
    slope, k1, k2, tau = gains.lambda_, gains.k1, gains.k2, gains.tau
    inertia, load = one_segment(wrist, now.theta, now.rate)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    s = error_rate + slope * error
    width = k1 * tau
    # x = -width/2 + sqrt(width^2/4 + |s|), written without the difference
    spread = sqrt(width * width + 4.0 * abs(s))
    root = 2.0 * s / (width + spread)
    twist = memory[0] - now.period * 2.0 * k2 * root / spread
    torque = load + inertia * (now.acceleration_ref - slope * error_rate - k1 * root + twist)
    memory[0] = where(delivered(now, torque), twist, memory[0])
    return torque


SUPER_TWISTING = Controller(
    name="super-twisting",
    law=law,
    source="Levant, Int. J. Control 58 (1993) 1247; Moreno, CCE (2009), generalised; surface and model are our design",
    gains={
        "lambda": Gain("1/s", "weight of the error in s", 1e-1, 1e5),
        "k1": Gain("rad^0.5/s^1.5", "gain of the root", 1e-1, 1e5),
        "k2": Gain("rad/s^3", "rate of the twisting term", 1e0, 1e6),
        "tau": Gain("s", "time constant near s = 0", 1e-5, 1e1),
    },
    presets={
        "default": {"lambda": 140.0, "k1": 500.0, "k2": 5e4, "tau": 0.0036},
        "hardware": {"lambda": 5.4, "k1": 100.0, "k2": 1.4e4, "tau": 0.017},
    },
    memory=1,
    notes={
        "default": "chosen by trial on the four-segment plant at 1 kHz",
        "hardware": "behind a 60 Hz camera, steppers and tendons of 8 to 40 kN/m: by docs/preset_search.py",
    },
    conditions={"hardware": Conditions((5e-3, 1e-2), (2e4, 1e5))},
    surface=Surface(lambda gains: (gains["lambda"], 1.0, 0.0), lambda gains: 0.25 * (gains["k1"] * gains["tau"]) ** 2),
)
