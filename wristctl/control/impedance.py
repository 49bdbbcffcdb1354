"""Impedance control with a network that learns what the model lacks (Front. Robot. AI 12 (2025) 1665267).

Of the group's law its parts are known, the model's torque, an impedance about the reference and a network of angle and
rate, and neither gains nor how the network learns. Here it learns while it runs, from the load torque that the momentum
shows beyond the model, by normalised least mean squares; its hidden layer stays as it was drawn.
"""

from typing import Any

import numpy as np

from wristctl.control.clamped_integral import delivered
from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import one_segment
from wristctl.lanes.functions import tanh
from wristctl.lanes.lane import where, zero_like

UNITS = 8
# Typical size of angle [rad] and rate [rad/s].
_SCALES = np.array([0.5, 1.0])


def _drawn() -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    rng = np.random.default_rng(11)
    by_angle, by_rate = (rng.normal(0.0, 1.0, (UNITS, 2)) / _SCALES).T
    return tuple(by_angle.tolist()), tuple(by_rate.tolist()), tuple(rng.uniform(-1.0, 1.0, UNITS).tolist())


_BY_ANGLE, _BY_RATE, _OFFSETS = _drawn()


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta, rate) - K e - D de/dt - r, r = w0 + sum_j wj tanh(aj theta + bj rate + cj).

    The weights w move by eta (d - r) phi/(1 + h eta phi.phi) a second, d the load torque that the momentum shows, phi
    the units' outputs with 1 before them, as long as tendons and motors deliver.
    """
    unmodelled = disturbance(now, wrist, gains.wo, memory, 0)
    inertia, load = one_segment(wrist, now.theta, now.rate)
    zero = zero_like(inertia)
    residual, size = memory[VALUES], 1.0 + zero
    for j in range(UNITS):
        unit = tanh(_BY_ANGLE[j] * now.theta + _BY_RATE[j] * now.rate + _OFFSETS[j])
        residual = residual + memory[VALUES + 1 + j] * unit
        size = size + unit * unit
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    stiff = gains.K * error + gains.D * error_rate
    torque = inertia * now.acceleration_ref + load - stiff - residual
    share = now.period * gains.eta
    step = where(delivered(now, torque), share / (1.0 + share * size) * (unmodelled - residual), zero)
    memory[VALUES] = memory[VALUES] + step
    for j in range(UNITS):
        unit = tanh(_BY_ANGLE[j] * now.theta + _BY_RATE[j] * now.rate + _OFFSETS[j])
        memory[VALUES + 1 + j] = memory[VALUES + 1 + j] + step * unit
    remember(now, wrist, unmodelled, torque, memory, 0)
    return torque


IMPEDANCE = Controller(
    name="impedance",
    law=law,
    source="Front. Robot. AI 12 (2025) 1665267, as far as it is specified; how its network learns is our choice",
    gains={
        "K": Gain("N m/rad", "stiffness of the impedance", 1e-2, 1e4),
        "D": Gain("N m s/rad", "its damping", 1e-4, 1e2),
        "eta": Gain("1/s", "rate of learning", 1e-2, 1e4),
        "wo": Gain("rad/s", "bandwidth at which the load torque is observed", 1e-1, 1e5),
    },
    presets={
        "default": {"K": 5.0, "D": 0.2, "eta": 20.0, "wo": 100.0},
        "hardware": {"K": 4.0, "D": 0.1, "eta": 10.0, "wo": 200.0},
    },
    memory=VALUES + 1 + UNITS,
    notes={"hardware": BY_TRIAL},
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
