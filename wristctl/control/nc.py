"""An adaptive neuro-controller: no model of the wrist, a network learns the torque. The group's law is not printed."""

from typing import Any

import numpy as np

from wristctl.control.clamped_integral import delivered
from wristctl.control.law import Conditions, Controller, Gain
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import tanh
from wristctl.lanes.lane import where, zero_like

# Hidden units; the first layer is random and fixed (functional link), only the second learns.
UNITS = 12

INPUTS = 5
# Typical size of angle, rate, reference angle, rate and acceleration [rad, s].
_SCALES = np.array([0.5, 2.0, 0.5, 2.0, 10.0])


def _first_layer() -> tuple[tuple[float, ...], tuple[float, ...]]:
    rng = np.random.default_rng(5)
    weights = rng.normal(0.0, 0.7, (UNITS, INPUTS)) / _SCALES
    return tuple(map(float, weights.ravel())), tuple(map(float, rng.uniform(-1.5, 1.5, UNITS)))


_FIRST, _OFFSETS = _first_layer()


@compiled
def _unit(j: Any, inputs: Any) -> Any:
    total = _OFFSETS[j] + zero_like(inputs[0])
    for k in range(INPUTS):
        total = total + _FIRST[INPUTS * j + k] * inputs[k]
    return tanh(total)


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """-Kv r + W^T phi(x) on r = de/dt + lambda e, W' = -Gamma (phi r + kappa |r| W) (e-modification).

    phi holds tanh units of x = (theta, rate, theta_ref, rate_ref, theta_ref'') and 1 (Lewis, Jagannathan and Yesildirek
    1999). r is ultimately bounded; so is W, and by the implicit Euler rule used here for any r and any
    gains: |W_next| <= (|W| + a |phi|)/(1 + a kappa) with a = h Gamma |r|, never above the larger of |W| and
    |phi|/kappa <= sqrt(UNITS + 1)/kappa. Learning holds while a tendon saturates.
    """
    slope, feedback, rate_of_learning, forgetting = gains.lambda_, gains.Kv, gains.Gamma, gains.kappa
    inputs = (now.theta, now.rate, now.theta_ref, now.rate_ref, now.acceleration_ref)
    r = now.rate - now.rate_ref + slope * (now.theta - now.theta_ref)
    torque = memory[UNITS] - feedback * r
    for j in range(UNITS):
        torque = torque + memory[j] * _unit(j, inputs)
    step = now.period * rate_of_learning
    kept = 1.0 / (1.0 + step * forgetting * abs(r))
    learns = delivered(now, torque)
    for j in range(UNITS):
        memory[j] = where(learns, kept * (memory[j] - step * r * _unit(j, inputs)), memory[j])
    memory[UNITS] = where(learns, kept * (memory[UNITS] - step * r), memory[UNITS])
    return torque


NC = Controller(
    name="nc",
    law=law,
    source="our design after Lewis, Jagannathan and Yesildirek (1999); the paper names an NC only",
    gains={
        "lambda": Gain("1/s", "weight of the error in r", 1e-1, 1e5),
        "Kv": Gain("N m s/rad", "feedback of r", 1e-4, 1e2),
        "Gamma": Gain("N m/rad", "learning gain", 1e-3, 1e3),
        "kappa": Gain("1/(N m)", "e-modification: bounds the weights", 1e-3, 1e3),
    },
    presets={
        "default": {"lambda": 50.0, "Kv": 0.5, "Gamma": 2.0, "kappa": 0.1},
        "hardware": {"lambda": 8.2, "Kv": 0.29, "Gamma": 2.1, "kappa": 0.014},
    },
    memory=UNITS + 1,
    notes={
        "default": "our design; chosen by trial on the four-segment plant at 1 kHz",
        "hardware": "behind a 60 Hz camera, steppers and tendons of 8 to 40 kN/m: by docs/preset_search.py",
    },
    conditions={"default": Conditions((5e-3, 1e-2), (4e4, 1e5)), "hardware": Conditions((1e-3, 1e-2), (2e4, 1e5))},
)
