"""Tendons on Dynamixel X servos as a rig: a class that a robot's file completes by its sensor, `bend()`.

Each servo goes to positions with no more current than its tendon bears. Every tick one packet has the goals of all and
one exchange reads what each says of itself: hardware errors by their names, its current as a tension, its position.
A port of `emulated` is a rehearsal: servos and wrist are simulated, and so is the bend. docs/servos.md has an example.
"""

from __future__ import annotations

import logging
import math
from typing import Any, NoReturn

import numpy as np

from wristctl.arrays import Array
from wristctl.board.check import latency_timer, shorter
from wristctl.rig import Clock, Facts, Fault, Look, Lost, Reeled, Refused, WallClock
from wristctl.servos.emulated import Emulated, ServoRehearsal
from wristctl.servos.servo_bus import ServoBus, opened
from wristctl.servos.servo_settings import Servo, ServoSettings
from wristctl.servos.servo_watch import ServoWatch
from wristctl.servos.x_series import (
    BUS_WATCHDOG,
    COUNTS,
    CURRENT_BASED_POSITION,
    CURRENT_LIMIT,
    DRIVE_MODE,
    FURTHEST,
    GOAL_CURRENT,
    GOAL_POSITION,
    HARDWARE_ERROR,
    OPERATING_MODE,
    PRESENT_POSITION,
    PROFILE_ACCELERATION,
    PROFILE_VELOCITY,
    RETURN_DELAY,
    STATUS_RETURN_LEVEL,
    TEMPERATURE_LIMIT,
    TORQUE_ENABLE,
    VELOCITY_UNIT,
    WATCHDOG_UNIT,
    Item,
    named_errors,
)

__all__ = ["DynamixelRig", "Servo", "ServoSettings"]

log = logging.getLogger(__name__)

# Seconds within which a servo is back after its reboot; longest exchange that a tick of 10 ms has room for.
_BACK, _SLOWEST = 2.0, 6e-3
# Exchanges without an answer, one after the other, after which a bus counts as lost.
_LOST = 3
# Pause between a reboot and the first question [s], and between two questions.
_PAUSE = 0.1


class DynamixelRig:
    """Tendons on Dynamixel servos. A robot's class is made of it, with `facts = SETTINGS.facts` and its own `bend`.

    `port` is the path of a serial adapter; `emulated`, or an `Emulated` with a fault, is a rehearsal in virtual time.
    """

    facts: Facts
    clock: Clock

    def __init__(self, settings: ServoSettings, port: str | Emulated) -> None:
        self.settings, self.facts = settings, settings.facts
        self._senses = np.array([servo.sense for servo in settings.servos])
        self._ids = [servo.id for servo in settings.servos]
        emulated = Emulated() if port == "emulated" else port
        self._path = "the emulated bus" if isinstance(emulated, Emulated) else emulated
        self.rehearsal = ServoRehearsal(settings, emulated) if isinstance(emulated, Emulated) else None
        """The emulated servos with their wrist; None of real ones."""
        self.clock = WallClock() if self.rehearsal is None else self.rehearsal.clock
        self._port: Any = None
        self._sensing = False
        self._bus: ServoBus | None = None
        self._missed, self.missed = 0, 0
        """Exchanges that brought no answer since `connect`."""
        self._units = np.ones(len(self._ids))
        self._tension: Array | None = None
        self._reeled: Reeled | None = None

    def open_sensor(self) -> None:
        """Make the robot's own sensor ready; not called in a rehearsal."""

    def bend(self) -> tuple[Any, float]:
        """Newest bend (P,) [rad] of the wrist by the robot's own sensor, and when it was true on `clock` [s].

        Does not wait for another. Not called in a rehearsal.
        """
        raise NotImplementedError("the rig's class has no bend(): the bend by your sensor, and its time")

    def close_sensor(self) -> None:
        """Give the robot's own sensor back."""

    def connect(self) -> Array:
        """Find, set up and energise the servos where they stand; their positions as targets (T,) [counts].

        A servo that had shut down is rebooted: homing follows, which finds its tendon anew.
        """
        self.close()
        try:
            if self.rehearsal is not None:
                self._port = self.rehearsal.port()
            else:
                self._port = opened(self._path, self.settings.baud)
                self._sensing = True
                self.open_sensor()
            self._bus = bus = ServoBus(self._port, self._ids, self._path)
            bus.find()
            for number in self._ids:
                self._revive(bus, number)
                self._set_up(bus, number)
            bus.arrange()
            if (took := bus.measure(self.clock.now)) > _SLOWEST:
                raise Fault(f"slow bus: an exchange takes {1e3 * took:.0f} ms of a tick. {self._why_slow()}")
            stood = [bus.value(number, PRESENT_POSITION) for number in self._ids]
            furthest = FURTHEST - self.settings.travel / self.settings.metres_per_count
            for number, position in zip(self._ids, stood, strict=True):
                if abs(position) > furthest:
                    raise Fault(f"servo {number} stands {position / COUNTS:.0f} turns from its zero: reboot it")
            for number, position in zip(self._ids, stood, strict=True):
                bus.set(number, GOAL_POSITION, position, "Goal Position")
                bus.set(number, TORQUE_ENABLE, 1, "Torque Enable")
                bus.set(number, BUS_WATCHDOG, self.settings.watchdog, "Bus Watchdog")
        except BaseException:
            self.close()
            raise
        self._units = np.array([bus.models[number].current_unit for number in self._ids])
        limits = [bus.value(number, TEMPERATURE_LIMIT) for number in self._ids]
        self._watch = ServoWatch(self.settings, limits, stood, self.clock.now())
        self._goals, self._missed, self.missed = list(stood), 0, 0
        self._zero = np.array(stood) * self._senses
        self._heard()
        return np.asarray(self._zero, float)

    def _why_slow(self) -> str:
        timer = latency_timer(self._path)
        if timer is not None and timer > 1e-3:
            return f"The adapter's latency timer is {1e3 * timer:.0f} ms: {shorter(self._path)}"
        return "See the servos' Baud Rate (1000000 or more) and the adapter's latency"

    def _revive(self, bus: ServoBus, number: int) -> None:
        """Reboot a servo that has shut down. Raises Fault where its error stays."""
        if not (error := bus.value(number, HARDWARE_ERROR)):
            return
        log.warning("servo %d had shut down: %s; it is rebooted", number, ", ".join(named_errors(error)))
        bus.reboot(number)
        end = self.clock.now() + _BACK
        self._pause(_PAUSE)
        while not bus.pinged(number) and self.clock.now() < end:
            self._pause(_PAUSE)
        if error := bus.value(number, HARDWARE_ERROR):
            raise Fault(f"{', '.join(named_errors(error))}: servo {number} reports it after its reboot too")

    def _pause(self, seconds: float) -> None:
        self.clock.wait_until(self.clock.now() + seconds)

    def _set_up(self, bus: ServoBus, number: int) -> None:
        unit = bus.models[number].current_unit
        current = math.floor(self.settings.current / unit)
        fastest = max(1, math.floor(self.settings.rate / self.settings.spool_radius / VELOCITY_UNIT))
        if current < 2:
            needed = 1e3 * self.settings.current
            raise Fault(f"{self.settings.tension:g} N are {needed:.1f} mA, too few for servo {number} to tell")
        settings: list[tuple[Item, int, str]] = [
            (TORQUE_ENABLE, 0, "Torque Enable"),
            (BUS_WATCHDOG, 0, "Bus Watchdog"),
            (STATUS_RETURN_LEVEL, 2, "Status Return Level"),
            (RETURN_DELAY, 0, "Return Delay Time"),
            (DRIVE_MODE, 0, "Drive Mode"),
            (OPERATING_MODE, CURRENT_BASED_POSITION, "Operating Mode"),
            (CURRENT_LIMIT, current, "Current Limit"),
            (GOAL_CURRENT, current, "Goal Current"),
            (PROFILE_ACCELERATION, 0, "Profile Acceleration"),
            (PROFILE_VELOCITY, fastest, "Profile Velocity"),
        ]
        for item, wanted, name in settings:
            bus.set(number, item, wanted, name)

    def send(self, targets: Array) -> Array:
        """Have the servos go to these targets (T,), rounded; raises what they say of themselves."""
        targets = np.asarray(targets, float)
        furthest = self.settings.travel / self.settings.metres_per_count
        if not (np.abs(targets - self._zero) <= furthest).all():  # a nan is not either
            raise Refused(f"targets {targets} are not within {furthest:.0f} counts of {self._zero}")
        bus = self._connected()
        sent = np.rint(targets)
        self._goals = [int(goal) for goal in sent * self._senses]
        bus.follow(self._goals)
        self._heard()
        return sent

    def _connected(self) -> ServoBus:
        if self._bus is None:
            raise Lost("the servos are not connected")
        return self._bus

    def _heard(self) -> None:
        """Read all servos once, and judge what they say. Raises Fault and Lost."""
        bus, asked = self._connected(), self.clock.now()
        status = bus.status()
        now = self.clock.now()
        if status is not None:
            self._watch.judge(status)
        if status is None or not self._watch.is_new(status, now):
            self._missed, self.missed = self._missed + 1, self.missed + 1
            if self._missed >= _LOST:
                self._name_lost(bus, status is not None)
            return
        self._missed = 0
        currents = np.array([one.current for one in status]) * self._senses * self._units
        self._tension = np.maximum(0.0, currents * self.settings.torque_constant / self.settings.spool_radius)
        positions = np.array([one.position for one in status])
        self._reeled = Reeled(positions * self._senses, 0.5 * (asked + now))
        self._watch.judge_positions(positions, np.array(self._goals), self._tension, now)

    def _name_lost(self, bus: ServoBus, old: bool) -> NoReturn:
        if old:
            raise Lost(f"answers on {self._path} are old: the adapter holds them back. {self._why_slow()}")
        answering = bus.answering()
        silent = [number for number in self._ids if number not in answering]
        if not answering:
            raise Lost(f"no servo answers in time on {self._path}: see its power, the adapter's cable and its latency")
        if silent:
            which = " and ".join(f"servo {number} (tendon {self._ids.index(number) + 1})" for number in silent)
            raise Lost(f"no answer from {which}; others answer: see plugs and power")
        raise Lost(f"answers on {self._path} are lost again and again, though each servo answers alone: see its cables")

    def look(self) -> Look:
        """The bend by `bend()`, the tensions by the servos' currents, and where they are."""
        bend, time = self.bend() if self.rehearsal is None else self.rehearsal.bend()
        return Look(bend, time, self._tension, self._reeled)

    def stop(self) -> None:
        """Have every servo stay where it is; one whose position cannot be trusted lets go.

        Raises Lost where none can be told: then they stop by themselves once they hear nothing.
        """
        if self._bus is None:
            return
        bus, status = self._bus, None
        for _ in range(_LOST):
            if (status := bus.status()) is not None:
                break
        if status is not None:
            trusted = self._watch.trusted
            self._goals = [
                one.position if trusts else goal for one, trusts, goal in zip(status, trusted, self._goals, strict=True)
            ]
            self._watch.stopped(status)
        for number, trusts in zip(self._ids, self._watch.trusted, strict=True):
            if not trusts:
                bus.release(number)
        bus.follow(self._goals)
        if status is None:
            silence = self.settings.watchdog * WATCHDOG_UNIT
            raise Lost(f"the servos do not answer; they stop {silence:g} s after the last packet")

    def close(self) -> None:
        """Take the torque off all servos and close the port."""
        bus, port, self._bus, self._port = self._bus, self._port, None, None
        if bus is not None:
            for number in self._ids:
                bus.release(number)
        if port is not None:
            port.closePort()
        if self._sensing:
            self._sensing = False
            self.close_sensor()
