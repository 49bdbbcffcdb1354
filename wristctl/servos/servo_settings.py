"""Servos of a rig, their spools and limits, and the facts that these are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from wristctl.rig import Drive, Facts, Limits, Quantity, Sensor, Spread, Tendon
from wristctl.servos.x_series import COUNTS, WATCHDOG_UNIT


@dataclass(frozen=True)
class Servo:
    """A servo, the tendon that it winds, and the sense in which it does."""

    id: int
    tendon: Tendon
    sense: int = 1
    """1 where larger positions reel in, -1 where smaller ones do."""


@dataclass(frozen=True)
class ServoSettings:
    """Servos of a rig, their spools and limits. SI units."""

    servos: Sequence[Servo]
    """In the order of the targets."""
    spool_radius: float
    """From the axis to the middle of the tendon on the spool [m]."""
    torque_constant: float
    """Torque of the output for each ampere [N m/A]: measured, or the data sheet's stall torque over its current."""
    tension: float
    """Largest tension of a tendon [N]: it sets the servos' current."""
    sensor: Sensor
    """Of the bend."""
    planes: int = 2
    travel: float = 0.02
    """Furthest from where a servo stands at first [m]."""
    rate: float = 0.03
    """Fastest that a tendon is reeled in or let out [m/s]: at most the servo's speed without load at this radius."""
    drive_delay: Quantity = field(default_factory=lambda: Spread(3e-3, 1e-3, 6e-3))
    """From a packet until the servos follow it [s]."""
    drive_lag: Quantity = field(default_factory=lambda: Spread(0.016, 0.008, 0.03))
    """Time constant of a servo behind its goal [s]."""
    backlash: Quantity = 0.0
    """Of gear and tendon, as tendon [m]."""
    stiffness: Quantity = 20e3
    """Of one tendon with its servo [N/m]."""
    silence: float = 0.2
    """Seconds without a packet after which servos stop by themselves; whole units of 20 ms."""
    baud: int = 1_000_000
    wrist: Mapping[str, Any] = field(default_factory=dict)
    """What is known of the wrist, by the keys of a study's section `wrist`."""

    @property
    def metres_per_count(self) -> float:
        """Tendon of one position [m]."""
        return 2.0 * math.pi * self.spool_radius / COUNTS

    @property
    def watchdog(self) -> int:
        """Silence in the servos' unit."""
        return min(127, max(1, round(self.silence / WATCHDOG_UNIT)))

    @property
    def current(self) -> float:
        """Current that makes the largest tension [A]."""
        return self.tension * self.spool_radius / self.torque_constant

    @property
    def facts(self) -> Facts:
        """Facts of the rig: a target is a position that reels in as it grows [counts]."""
        return Facts(
            planes=self.planes,
            tendons=[servo.tendon for servo in self.servos],
            unit="counts",
            metres_per_unit=self.metres_per_count,
            limits=Limits(self.travel, self.rate, self.tension),
            drive=Drive(self.drive_delay, self.drive_lag, self.metres_per_count, self.backlash, self.stiffness),
            sensor=self.sensor,
            silence=self.watchdog * WATCHDOG_UNIT,
            wrist=self.wrist,
        )  # fmt: skip
