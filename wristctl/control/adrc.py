"""Active disturbance rejection: no model but an inertia; all else is one load that an observer estimates."""

from typing import Any

from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import one_segment_terms
from wristctl.lanes.functions import clip, expm1_of_negative
from wristctl.lanes.lane import where, zero_like

_STARTED, _ANGLE, _RATE, _LOAD = range(4)


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """(theta_ref'' - 2 wc (z2 - rate_ref) - wc^2 (z1 - theta_ref) - z3)/b (Gao, ACC 2003, 4989).

    z is what a linear observer with a triple pole at -wo makes of the angle alone: angle, rate, and the acceleration
    that is not b times the torque: spring, damper, gravity and loads together. b is beta/M, M the inertia of the
    one-segment wrist. The observer is sampled exactly (Miklosovic, Radke and Gao, ACC 2006, 3071) and so stable for any
    wo; it is told the torque that tendons reach and motors deliver, so nothing winds up.
    """
    h = now.period
    inertia, _, _ = one_segment_terms(wrist, now.theta)
    effect = gains.beta / inertia
    started = memory[_STARTED] > 0.0
    angle, rate = where(started, memory[_ANGLE], now.theta), where(started, memory[_RATE], now.rate)
    angle, rate = angle - 0.5 * h * h * effect * now.withheld, rate - h * effect * now.withheld
    load = memory[_LOAD]
    lost = -expm1_of_negative(-gains.wo * h)  # 1 - pole
    pole, innovation = 1.0 - lost, now.theta - angle
    angle = angle + (1.0 - pole * pole * pole) * innovation
    rate = rate + 1.5 * lost * lost * (1.0 + pole) / h * innovation
    load = load + lost * lost * lost / (h * h) * innovation

    wc = gains.wc
    wanted = now.acceleration_ref - wc * (2.0 * (rate - now.rate_ref) + wc * (angle - now.theta_ref)) - load
    torque = wanted / effect
    push = effect * clip(torque, now.torque_low, now.torque_high) + load
    memory[_STARTED] = 1.0 + zero_like(h)
    memory[_ANGLE] = angle + h * (rate + 0.5 * h * push)
    memory[_RATE] = rate + h * push
    memory[_LOAD] = load
    return torque


ADRC = Controller(
    name="adrc",
    law=law,
    source="Gao, American Control Conference (2003) 4989; Han, IEEE Trans. Ind. Electron. 56 (2009) 900",
    gains={
        "wc": Gain("rad/s", "double pole of the error", 1e-1, 1e5),
        "wo": Gain("rad/s", "triple pole of the observer", 1e-1, 1e5),
        "beta": Gain("", "effect of the torque, as a multiple of the model's 1/M", 1e-3, 1e3),
    },
    presets={
        "default": {"wc": 30.0, "wo": 200.0, "beta": 1.0},
        "hardware": {"wc": 30.0, "wo": 120.0, "beta": 2.0},
    },
    memory=4,
    notes={"hardware": BY_TRIAL},
    conditions={"hardware": Conditions((1e-3, 1e-2), (8e3, 1e5))},
)
