"""Classes of conditions that a law is judged in, so that an answer says where it holds."""

from __future__ import annotations

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.disturbances import DISTURBANCES
from wristctl.simulation.worlds import World, mismatches

CLASSES = ("ideal", "sampled", "camera and tendons", "pushed", "off-nominal")
"""From what a law is designed for to what it meets."""
_CONTINUOUS = 1e-4
"""Control period [s] up to which a torque is held so briefly that a law need not know of it."""


def class_of(loop: Loop, wrist: WristParameters) -> str:
    """The class of a loop: what is hardest about it.

    pushed: a force acts. camera and tendons: motors and tendons, or a camera, are simulated. off-nominal: the plant is
    not what its controller believes. ideal: it is, to the last segment, in nearly continuous time and without a limit
    of tension. sampled: the rest.
    """
    acting = [each for each in DISTURBANCES.values() if each.acts(loop.disturbances)]
    if any(each.force is not None for each in acting):
        return "pushed"
    if loop.actuator.level == "tendon" or loop.sensor.level == "camera":
        return "camera and tendons"
    if acting or loop.actuator.level != "ideal" or mismatches(World(loop, wrist)):
        return "off-nominal"
    nearly = loop.plant_segments == 1 and not loop.limits and loop.control_period <= _CONTINUOUS
    return "ideal" if nearly else "sampled"
