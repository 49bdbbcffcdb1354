"""Feedforward and a fractional-order PI: an integral of the error whose order is a gain.

Of soft links and necks (Mena and others, Front. Robot. AI 7 (2020) 27), there about the tip's inclination. The order is
split, s^-lambda = s^-1 s^(1 - lambda): what is integrated once leaves no error at rest, and s^(1 - lambda) is
Oustaloup's filter (Oustaloup and others, IEEE Trans. Circuits Syst. I 47 (2000) 25).
"""

from typing import Any

from wristctl.control.clamped_integral import held, integrated
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import inverse_dynamics
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import expm1_of_negative, power

# The band [rad/s] over which Oustaloup's filter stands for the fractional power, and its sections.
LOWEST, HIGHEST = 0.1, 1e3
SECTIONS = 7


@compiled
def fractional(value: Any, order: Any, period: Any, memory: Any, first: int) -> Any:
    """The derivative of this fractional order, -1 to 1, of a value held since the period before.

    Zeros and poles alternate, evenly on a logarithmic scale; each pole's low pass is exact for a held input. It needs
    SECTIONS values of memory, from `first` on.
    """
    ratio = HIGHEST / LOWEST
    result = power(HIGHEST + 0.0 * order, order) * value
    apart = power(ratio + 0.0 * order, -order / SECTIONS)
    for k in range(SECTIONS):
        pole = LOWEST * power(ratio + 0.0 * order, (k + 0.5 * (1.0 + order)) / SECTIONS)
        passed = memory[first + k] - expm1_of_negative(-pole * period) * (result - memory[first + k])
        memory[first + k] = passed
        result = result + (apart - 1.0) * passed
    return result


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - Kp e - Ki D^-lambda e, its integral held in saturation."""
    integral = integrated(now, memory[0])
    error = now.theta - now.theta_ref
    feedback = gains.Kp * error + gains.Ki * fractional(integral, 1.0 - gains.lambda_, now.period, memory, 1)
    fed_forward = inverse_dynamics(wrist, now.theta_ref, now.rate_ref, now.acceleration_ref)
    torque = fed_forward - feedback
    memory[0] = held(now, torque, memory[0], integral)
    return torque


FOPI = Controller(
    name="fopi",
    law=law,
    source="Mena and others, Front. Robot. AI 7 (2020) 27; about feedforward",
    gains={
        "Kp": Gain("N m/rad", "proportional gain", 1e-2, 1e4),
        "Ki": Gain("N m/(rad s^lambda)", "gain of the fractional integral", 1e-2, 1e4),
        "lambda": Gain("", "order of the integral", 0.05, 1.95),
    },
    presets={
        "default": {"Kp": 2.0, "Ki": 20.0, "lambda": 0.9},
        "hardware": {"Kp": 1.0, "Ki": 20.0, "lambda": 0.9},
    },
    memory=1 + SECTIONS,
    notes={"hardware": BY_TRIAL},
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
