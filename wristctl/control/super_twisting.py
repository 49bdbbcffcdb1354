"""Super-twisting: a second-order sliding mode whose torque is continuous."""

from __future__ import annotations

from typing import Any

from wristctl.control.law import Controller, Gain
from wristctl.control.model import one_segment
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import sqrt, where


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """Torque that makes s' = -k1 sqrt(|s|) sgn(s) + v, v' = -k2 sgn(s) on s = de/dt + lambda e (Levant 1993).

    torque = load + M (theta_ref'' - lambda de/dt + s'). The jump sits in v', so the torque is continuous, and a model
    error whose acceleration changes slower than k2 is met exactly after a finite time. Sampled by the implicit Euler
    rule, which does not chatter: with b = s + h v and x = sqrt(|s_next|), s_next = b - sgn (h k1 x + h^2 k2) gives
    x = -h k1/2 + sqrt((h k1/2)^2 + |b| - h^2 k2) where |b| > h^2 k2; else s_next = 0 is reached within this period.
    v holds while a tendon saturates.
    """
    slope, k1, k2 = gains[0], gains[1], gains[2]
    h = now.period
    inertia, load = one_segment(wrist, now.theta, now.rate)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    s = error_rate + slope * error
    free = s + h * memory[0]
    beyond = abs(free) - h * h * k2
    half = 0.5 * h * k1
    root = sqrt(half * half + maximum(beyond, 0.0 * h)) - half
    sign = where(free > 0.0, 1.0, 0.0 * h - 1.0)
    twist = where(beyond > 0.0, memory[0] - h * k2 * sign, -s / h)
    torque = load + inertia * (now.acceleration_ref - slope * error_rate - k1 * root * sign + twist)
    within = (torque <= now.torque_high) & (torque >= now.torque_low)
    memory[0] = where(within, twist, memory[0])
    return torque


SUPER_TWISTING = Controller(
    name="super-twisting",
    law=law,
    source="Levant, Int. J. Control 58 (1993) 1247; implicit: Brogliato, Polyakov and Efimov, IEEE TAC 65 (2020) 3707; "
    "surface and model feedforward are our design",
    gains={
        "lambda": Gain("1/s", "weight of the error in s", 1e-1, 1e5),
        "k1": Gain("(rad)^0.5/s^1.5", "gain of the square root", 1e-1, 1e5),
        "k2": Gain("rad/s^3", "rate of the twisting term", 1e0, 1e6),
    },
    presets={"default": (50.0, 60.0, 2000.0)},
    memory=1,
    notes={"default": "chosen by trial on the four-segment plant at 1 kHz"},
)
