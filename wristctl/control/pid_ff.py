"""Feedforward and PID: what an integral adds to `pd-ff`."""

from __future__ import annotations

from typing import Any

from wristctl.control import pd_ff
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import where

GAINS = pd_ff.GAINS | {"Ki": Gain("N m/(rad s)", "integral gain", 1e-2, 1e4)}


@compiled
def integrated(now: Any, integral: Any) -> Any:
    """The integral of the error with this period's [rad s]."""
    return integral + now.period * (now.theta - now.theta_ref)


@compiled
def held(now: Any, torque: Any, old: Any, new: Any) -> Any:
    """The new integral, or the old one where the new would drive a saturated tendon on."""
    error = now.theta - now.theta_ref
    stays = ((torque > now.torque_high) & (error < 0.0)) | ((torque < now.torque_low) & (error > 0.0))
    return where(stays, old, new)


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M theta_ref'' + load(theta_ref, rate_ref) - Kp e - Ki int(e) - Kd de/dt, held in saturation."""
    integral = integrated(now, memory[0])
    torque = pd_ff.fed_forward_pd(now, wrist, gains) - gains.Ki * integral
    memory[0] = held(now, torque, memory[0], integral)
    return torque


PID_FF = Controller(
    name="pid-ff",
    law=law,
    source="baseline: what an integral adds to pd-ff",
    gains=GAINS,
    presets={
        "default": {"Kp": 1.0, "Ki": 5.0, "Kd": 0.1},
        "stepper": {"Kp": 5.0, "Ki": 100.0, "Kd": 0.4},
    },
    memory=1,
    notes={"stepper": BY_TRIAL},
    conditions={"default": Conditions((1e-3, 1e-2), (8e3, 1e5)), "stepper": Conditions((1e-3, 1e-2), (8e3, 1e5))},
)
