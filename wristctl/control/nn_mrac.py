"""The group's network-based model reference controller (arXiv 2510.19068), as far as it is specified.

Specified: a second-order reference model, printed as "-4s^2+3s+5" and read as 5/(s^2 + 3 s + 5) (w = 2.24 rad/s, zeta =
0.67); a network with one hidden layer, w2 phi(w1 x + b1) + b2, whose inputs are the wanted motion and the difference of
wrist and reference model, and whose output is the force. Not specified, and our choice: that it learns while it runs,
by the gradient of that difference (the MIT rule); its width, its initial weights, its rate; the scale of its output
(the torque in reach); and a unit gain of 5/5 where theirs is 4/5 or 4.
"""

from typing import Any

import numpy as np

from wristctl.control.clamped_integral import delivered
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.lanes.functions import clip, tanh
from wristctl.lanes.lane import where, zero_like

UNITS, INPUTS = 8, 4
# Typical size of the wanted angle, the model's angle, the difference and its rate [rad, s].
_SCALES = np.array([0.5, 0.5, 0.1, 1.0])
_PER_UNIT = INPUTS + 2
# Place in memory of whether it has begun, the reference model's angle and its rate, behind all weights.
_MODEL = UNITS * _PER_UNIT + 1


def _initial() -> tuple[float, ...]:
    rng = np.random.default_rng(11)
    weights, offsets = rng.normal(0.0, 0.7, (UNITS, INPUTS)) / _SCALES, rng.uniform(-1.0, 1.0, (UNITS, 1))
    return tuple(map(float, np.concatenate([weights, offsets], axis=1).ravel()))


_FIRST = _initial()


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """T (w2 tanh(w1 x + b1) + b2) - Kd de_m/dt on e_m = theta - theta_m, T the torque in reach.

    All weights learn by -eta (e_m + de_m/dt / w) times the output's gradient, as long as no tendon saturates; memory
    holds their difference from the initial ones.
    """
    h, zero = now.period, zero_like(now.period)
    w = gains.w
    begun = memory[_MODEL] > zero
    angle_m = where(begun, memory[_MODEL + 1], now.theta)
    rate_m = where(begun, memory[_MODEL + 2], now.rate)
    error, error_rate = now.theta - angle_m, now.rate - rate_m
    inputs = (now.theta_ref, angle_m, error, error_rate)
    reach = 0.5 * (now.torque_high - now.torque_low)
    reach = where(reach < 1e3, reach, 1.0 + zero)
    output = memory[UNITS * _PER_UNIT]
    for j in range(UNITS):
        first = _PER_UNIT * j
        total = _FIRST[(INPUTS + 1) * j + INPUTS] + memory[first + INPUTS]
        for k in range(INPUTS):
            total = total + (_FIRST[(INPUTS + 1) * j + k] + memory[first + k]) * inputs[k]
        output = output + memory[first + INPUTS + 1] * tanh(total)
    torque = reach * output - gains.Kd * error_rate
    learns = delivered(now, torque)
    step = where(learns, -h * gains.eta * (error + error_rate / w), zero)
    for j in range(UNITS):
        first = _PER_UNIT * j
        total = _FIRST[(INPUTS + 1) * j + INPUTS] + memory[first + INPUTS]
        for k in range(INPUTS):
            total = total + (_FIRST[(INPUTS + 1) * j + k] + memory[first + k]) * inputs[k]
        unit = tanh(total)
        inner = step * memory[first + INPUTS + 1] * (1.0 - unit * unit)
        memory[first + INPUTS + 1] = clip(memory[first + INPUTS + 1] + step * unit, -10.0 + zero, 10.0 + zero)
        memory[first + INPUTS] = clip(memory[first + INPUTS] + inner, -10.0 + zero, 10.0 + zero)
        for k in range(INPUTS):
            memory[first + k] = clip(memory[first + k] + inner * inputs[k], -10.0 + zero, 10.0 + zero)
    last = UNITS * _PER_UNIT
    memory[last] = clip(memory[last] + step, -10.0 + zero, 10.0 + zero)

    # implicit Euler: stable for every w
    rate_m = (rate_m + h * w * w * (now.theta_ref - angle_m)) / (1.0 + h * w * (2.0 * gains.zeta + h * w))
    memory[_MODEL] = 1.0 + zero
    memory[_MODEL + 1] = angle_m + h * rate_m
    memory[_MODEL + 2] = rate_m
    return torque


NN_MRAC = Controller(
    name="nn-mrac",
    law=law,
    source="arXiv 2510.19068, as far as it is specified; learning while it runs is our choice",
    gains={
        "w": Gain("rad/s", "natural frequency of the reference model", 1e-1, 1e5),
        "zeta": Gain("", "its damping ratio", 1e-3, 1e3),
        "eta": Gain("1/(rad s)", "rate of learning", 1e-2, 1e4),
        "Kd": Gain("N m s/rad", "feedback of the difference's rate", 1e-4, 1e2),
    },
    presets={
        "published": {"w": 2.236, "zeta": 0.67, "eta": 10.0, "Kd": 0.1},
        "default": {"w": 50.0, "zeta": 1.0, "eta": 100.0, "Kd": 0.3},
        "hardware": {"w": 150.0, "zeta": 1.0, "eta": 20.0, "Kd": 0.3},
    },
    memory=_MODEL + 3,
    notes={
        "published": "its reference model; the rest is not specified",
        "hardware": BY_TRIAL,
    },
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
