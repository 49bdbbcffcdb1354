"""A rig of emulated servos, as tests begin with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from wristctl.servos.dynamixel import DynamixelRig
from wristctl.servos.emulated import Emulated, ServoRehearsal
from wristctl.servos.servo_bench import SETTINGS
from wristctl.servos.servo_settings import ServoSettings


def rehearsed(
    fault: str = "", settings: ServoSettings = SETTINGS, **emulated: Any
) -> tuple[DynamixelRig, ServoRehearsal]:
    """A rig that is not connected, and its servos; the fault is that of servo 2."""
    rig = DynamixelRig(settings, Emulated(fault, servo=2, **emulated))
    assert rig.rehearsal is not None
    return rig, rig.rehearsal


def passed(rig: DynamixelRig, seconds: float, targets: Any, period: float = 0.01) -> None:
    """Send the targets again and again for so long."""
    end = rig.clock.now() + seconds
    while rig.clock.now() < end:
        rig.send(targets)
        rig.clock.wait_until(rig.clock.now() + period)


def other(**changes: Any) -> ServoSettings:
    """The bench's settings but for these."""
    return replace(SETTINGS, **changes)
