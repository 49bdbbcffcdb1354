"""Presets for another wrist than the one that they were found on."""

from dataclasses import replace

import numpy as np

from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

# Bandwidth of what motors and a camera follow [rad/s], at which two wrists are compared.
_BANDWIDTH = 15.0


def dynamic_stiffness(wrist: WristParameters) -> float:
    """Torque per angle [N m/rad] that moves the straight wrist to and fro at 15 rad/s: |K - J w^2 + i D w|."""
    at_rest = terms(segments(wrist, 1), np.zeros(1), np.zeros(1))
    reaction = wrist.stiffness - float(at_rest.mass[0, 0]) * _BANDWIDTH**2
    return float(np.hypot(reaction, wrist.damping * _BANDWIDTH))


def scaled_to(wrist: WristParameters, law: Controller) -> Controller:
    """The controller with presets that give its loop the bandwidth on `wrist` that they give on the default wrist.

    Gains in units of torque, or of its inverse, are scaled by the ratio of both dynamic stiffnesses. Rates, damping
    ratios and gains of a model-based controller, which knows its wrist, stay. Scaled gains end at the search's box.
    """
    ratio = dynamic_stiffness(wrist) / dynamic_stiffness(WristParameters())
    powers = {name: _power_of_torque(gain.unit) for name, gain in law.gains.items()}
    presets = {
        preset: {
            name: float(np.clip(value * ratio ** powers[name], law.gains[name].low, law.gains[name].high))
            if powers[name]
            else value
            for name, value in gains.items()
        }
        for preset, gains in law.presets.items()
    }
    return replace(law, presets=presets)


def _power_of_torque(unit: str) -> int:
    """Power in which a unit has N m, which is J: 1 of N m s/rad, -1 of 1/(N m)."""
    above, _, below = unit.partition("/")
    return ("N m" in above) - ("N m" in below or "J" in below)
