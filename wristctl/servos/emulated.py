"""A rehearsal of a rig of servos: their bus with its faults, the wrist that they pull, and a sensor of its bend.

In virtual time behind a port of the SDK's kind (`EmulatedPort`), or in real time behind a pseudo-terminal
(`wristctl.servos.pseudo_terminal`), which any program can open.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError, meant
from wristctl.rig import VirtualClock, value
from wristctl.servos.emulated_servo import (
    BROADCAST,
    FAST_SYNC_READ,
    OVERLOAD,
    READ,
    STATUS,
    SYNC_READ,
    EmulatedServo,
    crc16,
    packets_of,
)
from wristctl.servos.servo_settings import ServoSettings
from wristctl.servos.servo_wrist import ATTACHED, FREE, ServoWrist

# Longest step of the simulation and shortest wait for a byte [s]; slack of the tendons at first [m].
_STEP, _POLL, _SLACK = 1e-3, 5e-5, 0.4e-3
# Seconds for which an adapter holds an answer back: by itself, and where its latency timer is the usual one.
_ADAPTER, _LATE = 0.5e-3, 16e-3
# Share of answers that are lost, positions by which an encoder errs, degrees a second by which a hot servo warms from
# which temperature on, id of a servo as nobody set it, jump of the sensor's zero [rad].
_LOST, _TURN, _WARMS, _WARM, _FACTORY, _ASTRAY = 0.02, 4096, 8.0, 66.0, 57, math.radians(6.0)

FAULTS = {
    "detached": "a tendon comes off",
    "stalled": "a servo's gear sticks",
    "exchanged": "two servos have each other's ids",
    "shut-down": "a servo shuts down: overload",
    "unplugged": "a plug between two servos comes off",
    "id-missing": "no servo has one of the ids",
    "id-doubled": "two servos have one id",
    "packet-lost": "one answer in fifty is lost",
    "late-bus": "the adapter holds answers back for 16 ms",
    "stale-position": "a servo says the same position for ever",
    "hot": "a servo warms",
    "wrong-zero": "a servo's encoder jumps by a turn",
    "wrong-bend": "the zero of the bend's sensor jumps by 6 deg",
}
"""Faults of a rehearsal, in words."""
FROM_THE_START = ("exchanged", "id-missing", "id-doubled", "packet-lost")
"""Those that are there from the start, whatever `bent_deg` is."""


@dataclass(frozen=True)
class Emulated:
    """Rehearsal of a rig with one fault, or none: the `port` of a `DynamixelRig`."""

    fault: str = ""
    servo: int = 1
    """Which one it is, counted from 1."""
    bent_deg: float = 8.0
    """Bend at which the fault begins [deg]: beyond those of homing."""
    seed: int = 0
    turns: tuple[int, ...] = ()
    """Turns of each servo since its power came."""

    def __post_init__(self) -> None:
        if self.fault and self.fault not in FAULTS:
            raise UserError(f"no fault {self.fault!r} of emulated servos", "Emulated", meant(self.fault, FAULTS))


class ServoRehearsal:
    """Servos with these settings on an emulated bus, pulling the simulated wrist.

    `wrist` is that of the settings; `stiffness` of its tendons is their drive's.
    """

    def __init__(self, settings: ServoSettings, emulated: Emulated) -> None:
        places = [TendonPlace(angle_deg=one.tendon.angle_deg, radius=one.tendon.radius) for one in settings.servos]
        wrist = WristParameters.model_validate({**settings.wrist, "tendons": tuple(places)})
        self.settings, self._fault = settings, emulated
        self.wrist = ServoWrist(wrist, settings.spool_radius, value(settings.stiffness), _SLACK)
        self._rng = np.random.default_rng(emulated.seed)
        self._faulty = (emulated.servo - 1) % len(settings.servos)
        numbers = [servo.id for servo in settings.servos]
        if emulated.fault == "exchanged":
            other = (self._faulty + 1) % len(numbers)
            numbers[self._faulty], numbers[other] = numbers[other], numbers[self._faulty]
        elif emulated.fault == "id-missing":
            numbers[self._faulty] = _FACTORY
        force = settings.torque_constant / settings.spool_radius
        self.servos = [
            EmulatedServo(number, row, force, settings.metres_per_count, int(self._rng.integers(4096)), servo.sense)
            for number, row, servo in zip(numbers, self.wrist.values, settings.servos, strict=True)
        ]
        for servo, turns in zip(self.servos, emulated.turns, strict=False):
            servo.turn(turns)
        if emulated.fault == "id-doubled":
            number = numbers[self._faulty]
            self.servos.append(EmulatedServo(number, None, force, settings.metres_per_count, 1234))
        self.began: float | None = None
        """When the fault began [s]."""
        self.largest_pull = 0.0
        """Largest tension of a tendon so far [N]."""
        self._latency, self._lost = _ADAPTER, _LOST if emulated.fault == "packet-lost" else 0.0
        self._buffer, self._seen = bytearray(), deque[tuple[float, Array]]()
        self._look_at = 0.0
        self._look: tuple[float, Array] = 0.0, np.zeros(settings.planes)
        self.clock = VirtualClock(self._advance, _STEP)
        self._advance(0.0, 0.0)

    def port(self) -> EmulatedPort:
        """A port at which the bus is."""
        return EmulatedPort(self)

    def bend(self) -> tuple[Array, float]:
        """Newest bend (P,) [rad] that the sensor gives, and when it was true [s]."""
        due = self.clock.now() - value(self.settings.sensor.delay)
        while self._seen and self._seen[0][0] <= due:
            self._look = self._seen.popleft()
        return self._look[1], self._look[0]

    def _advance(self, begin: float, end: float) -> None:
        for servo, force in zip(self.servos, [*self.wrist.force, 0.0], strict=False):
            servo.drive(end, float(force))
        if end > begin:
            self.wrist.advance(end - begin)
        self.largest_pull = max(self.largest_pull, float(self.wrist.pull.max()))
        bend, sensor = self.wrist.bend[: self.settings.planes], self.settings.sensor
        if end >= self._look_at:
            self._look_at = max(self._look_at + 1.0 / value(sensor.rate), end)
            noise = self._rng.normal(0.0, math.radians(value(sensor.noise_deg)), len(bend))
            astray = _ASTRAY if self.began is not None and self._fault.fault == "wrong-bend" else 0.0
            self._seen.append((end, bend + noise + astray))
        comes = self._fault.fault and self._fault.fault not in FROM_THE_START and self.began is None
        if comes and np.hypot.reduce(bend) > math.radians(self._fault.bent_deg):
            self.began = end
            self._begin()
        if self.began is not None and self._fault.fault == "hot":
            self.servos[self._faulty].temperature = _WARM + _WARMS * (end - self.began)

    def _begin(self) -> None:
        fault, servo, row = self._fault.fault, self.servos[self._faulty], self.wrist.values[self._faulty]
        if fault == "detached":
            row[ATTACHED] = 0.0
        elif fault == "stalled":
            row[FREE] = 0.0
        elif fault == "shut-down":
            servo.shut_down(OVERLOAD)
        elif fault == "unplugged":
            for behind in self.servos[self._faulty :]:
                behind.power_off()
        elif fault == "late-bus":
            self._latency = _LATE
        elif fault == "stale-position":
            servo.frozen = True
        elif fault == "wrong-zero":
            servo.shift = _TURN

    def receive(self, data: bytes) -> list[tuple[float, bytes]]:
        """Answers to bytes of the host, and when each has come back to it [s]."""
        self._buffer += data
        now, byte = self.clock.now(), 10.0 / self.settings.baud
        answers = list[tuple[float, bytes]]()
        for number, instruction, parameters in packets_of(self._buffer):
            arrived = now + (len(parameters) + 10) * byte
            for begin, answer in self._answers(number, instruction, parameters, arrived, byte):
                if self._rng.random() >= self._lost:
                    answers.append((begin + len(answer) * byte + self._latency, answer))
        return answers

    def _answers(
        self, number: int, instruction: int, parameters: bytes, time: float, byte: float
    ) -> list[tuple[float, bytes]]:
        """Answers to one packet that arrives at a time, with when they begin."""
        if instruction not in (SYNC_READ, FAST_SYNC_READ):
            told = [servo.answer(number, instruction, parameters, time) for servo in self.servos]
            return _collided([(time + delay, answer) for delay, answer in filter(None, told)])
        return self._all_answer(instruction, parameters, time, byte)

    def _all_answer(self, instruction: int, parameters: bytes, time: float, byte: float) -> list[tuple[float, bytes]]:
        """Each servo answers after the one before it; to a fast read by its part of one packet, without stuffing."""
        begun, ids, size = time, parameters[4:], int.from_bytes(parameters[2:4], "little")
        answers, whole = list[tuple[float, bytes]](), b""
        head = b"\xff\xff\xfd\x00" + bytes([BROADCAST]) + (len(ids) * (size + 4) + 1).to_bytes(2, "little")
        for number in ids:
            told = [servo.answer(number, READ, parameters[:4], time) for servo in self.servos]
            mine = _collided([(begun, answer) for _, answer in filter(None, told)])
            if not mine:
                return answers if instruction == SYNC_READ else []  # who comes after it waits for it
            answer = mine[0][1]
            if instruction == SYNC_READ:
                answers.append((begun, answer))
                begun += len(answer) * byte
                continue
            (_, _, told_of_it), *_ = [*packets_of(bytearray(answer)), (0, STATUS, b"\xff" * (size + 1))]
            whole = whole or head + bytes([STATUS])
            whole += bytes([told_of_it[0], number]) + told_of_it[1:]
            whole += crc16(whole).to_bytes(2, "little")
        return answers if instruction == SYNC_READ else [(begun, whole)]


def _collided(answers: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
    """Answers on the one wire: bytes that two servos send at once come out wrong, unless they are the same."""
    if len(answers) < 2 or abs(answers[0][0] - answers[1][0]) > 1e-4:
        return answers
    (begin, first), (_, second) = answers[:2]
    return [(begin, bytes(one & other for one, other in zip(first, second, strict=False)))]


class EmulatedPort:
    """A port of the SDK's kind to a rehearsal in virtual time, which passes while an answer is waited for."""

    patience = 0.04

    def __init__(self, rehearsal: ServoRehearsal) -> None:
        self._rehearsal, self._clock = rehearsal, rehearsal.clock
        self._coming, self._came = deque[tuple[float, bytes]](), bytearray()
        self._deadline, self.is_using = 0.0, False
        self.tx_time_per_byte = 1e4 / rehearsal.settings.baud

    def getBaudRate(self) -> int:
        """Of the bus."""
        return self._rehearsal.settings.baud

    def clearPort(self) -> None:
        """Forget what has come."""
        self._arrive()
        self._came.clear()

    def writePort(self, data: Any) -> int:
        """Send bytes."""
        self._coming.extend(self._rehearsal.receive(bytes(data)))
        return len(data)

    def readPort(self, length: int) -> bytes:
        """Bytes that have come; without any, time passes."""
        self._arrive()
        if not self._came:
            now = self._clock.now()
            due = self._coming[0][0] if self._coming else self._deadline
            self._clock.wait_until(now + max(_POLL, min(due - now, _STEP)))
            self._arrive()
        taken = bytes(self._came[:length])
        del self._came[:length]
        return taken

    def _arrive(self) -> None:
        while self._coming and self._coming[0][0] <= self._clock.now():
            self._came += self._coming.popleft()[1]

    def setPacketTimeout(self, packet_length: int) -> None:
        """Wait so long for an answer of so many bytes."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 1e3 * self.patience)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Wait so long."""
        self._deadline = self._clock.now() + 1e-3 * msec

    def isPacketTimeout(self) -> bool:
        """Whether it was waited for so long."""
        return self._clock.now() > self._deadline

    def closePort(self) -> None:
        """Nothing is to be given back."""
