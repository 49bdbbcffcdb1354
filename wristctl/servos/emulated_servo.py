"""An emulated Dynamixel X servo: control table, protocol 2.0, shutdown, bus watchdog; what it winds is simulated.

By the maker's e-manual: packets of the protocol 2.0, the control table of the XM430-W210.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from wristctl.arrays import Array
from wristctl.servos.servo_wrist import CLOSED, GOAL, MOST, PLACE
from wristctl.servos.x_series import (
    BUS_WATCHDOG,
    COUNTS,
    CURRENT_BASED_POSITION,
    CURRENT_LIMIT,
    FIRMWARE,
    FURTHEST,
    GOAL_CURRENT,
    GOAL_POSITION,
    HARDWARE_ERROR,
    INDIRECT_ADDRESS,
    INDIRECT_DATA,
    MODEL_NUMBER,
    MODELS,
    OPERATING_MODE,
    POSITION_P_GAIN,
    PRESENT_CURRENT,
    PRESENT_POSITION,
    PRESENT_TEMPERATURE,
    PRESENT_VELOCITY,
    PROFILE_VELOCITY,
    REALTIME_TICK,
    RETURN_DELAY,
    STATUS_RETURN_LEVEL,
    TEMPERATURE_LIMIT,
    TICKS,
    TORQUE_ENABLE,
    VELOCITY_UNIT,
    WATCHDOG_UNIT,
    Item,
)

PING, READ, WRITE, REBOOT, STATUS = 0x01, 0x02, 0x03, 0x08, 0x55
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ, BROADCAST = 0x82, 0x83, 0x8A, 0xFE
"""Instructions, and the id of all."""
INSTRUCTION_ERROR, RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR, ALERT = 2, 4, 5, 6, 7, 0x80
"""Errors of a status packet; the last is set beside them where Hardware Error Status is not 0."""
_HEADER, _EEPROM, _INDIRECT = b"\xff\xff\xfd\x00", 64, 20
# Bits of Hardware Error Status; P gain as the maker sets it; seconds after which a reboot is over.
OVERHEATING, OVERLOAD, _P_GAIN, _REBOOT = 1 << 2, 1 << 5, 800, 0.15
# Share of its largest current at which a servo is overloaded, and for how long it bears that [s].
_OVERLOADED, _BEARS = 0.95, 1.5


def crc16(data: bytes) -> int:
    """CRC-16 of the protocol: polynomial 0x8005, most significant bit first, from 0."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRCS[crc >> 8 ^ byte]
    return crc


def _crc_of_byte(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ (0x8005 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


_CRCS = tuple(map(_crc_of_byte, range(256)))


def stuffed(body: bytes) -> bytes:
    """Instruction and parameters, with a byte after each pattern that would be a header."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def packet(number: int, instruction: int, parameters: bytes) -> bytes:
    """A whole packet."""
    body = stuffed(bytes([instruction]) + parameters)
    head = _HEADER + bytes([number]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc16(head + body).to_bytes(2, "little")


def packets_of(data: bytearray) -> Iterable[tuple[int, int, bytes]]:
    """Ids, instructions and parameters of the whole packets in a buffer, which are taken out of it."""
    while (begin := data.find(_HEADER[:3])) >= 0:
        del data[:begin]
        if len(data) < 7 or len(data) < (size := 7 + int.from_bytes(data[5:7], "little")):
            return
        whole = bytes(data[:size])
        del data[:size]
        if size >= 10 and crc16(whole[:-2]).to_bytes(2, "little") == whole[-2:]:
            body = whole[7:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
            yield whole[4], body[0], body[1:]


_READ_ONLY = (MODEL_NUMBER, FIRMWARE, HARDWARE_ERROR, REALTIME_TICK, PRESENT_CURRENT, PRESENT_VELOCITY,
              PRESENT_POSITION, PRESENT_TEMPERATURE)  # fmt: skip
_GOALS = (GOAL_CURRENT, GOAL_POSITION)


class EmulatedServo:
    """A servo with this id, whose spool is `row` of a ServoWrist's values: None, it winds nothing.

    `newton_ampere` is the force along the tendon of an ampere [N/A], `metres_per_count` the tendon of one position; it
    begins at this position.
    """

    def __init__(
        self, number: int, row: Array | None, newton_ampere: float, metres_per_count: float, position: int,
        sense: int = 1, model: int = 1030,
    ) -> None:  # fmt: skip
        self.number, self.row = number, np.zeros(12) if row is None else row
        self._newton, self._unit, self._sense = newton_ampere, sense * metres_per_count, sense
        self._origin = position - self.row[PLACE] / self._unit
        self._model, self._table = model, bytearray(1024)
        self.shift, self.temperature, self.frozen = 0, 34.0, False
        """Counts by which its encoder errs, its temperature, and whether it says the same for ever."""
        self.silent_until, self._booted, self._heard, self._hard = -math.inf, 0.0, 0.0, 0.0
        self._time, self._trajectory = 0.0, float(position)
        for item, value in ((MODEL_NUMBER, model), (FIRMWARE, 47), (RETURN_DELAY, 250), (OPERATING_MODE, 3),
                            (CURRENT_LIMIT, 1193), (TEMPERATURE_LIMIT, 80), (Item(7, 1), number)):  # fmt: skip
            self._put(item, value)
        self._wake(0.0)

    def _wake(self, time: float) -> None:
        """Power on: what is not kept is as the maker set it."""
        self._table[_EEPROM:] = bytes(len(self._table) - _EEPROM)
        for item, value in ((STATUS_RETURN_LEVEL, 2), (POSITION_P_GAIN, _P_GAIN)):
            self._put(item, value)
        self._put(GOAL_CURRENT, self._get(CURRENT_LIMIT))
        for k in range(_INDIRECT):
            self._put(Item(INDIRECT_ADDRESS + 2 * k, 2), INDIRECT_DATA[0] + k)
        self._booted, self._hard = time, 0.0
        self.turn(-math.floor(self.place / COUNTS))  # several turns are forgotten

    def turn(self, turns: int) -> None:
        """Have so many turns counted more, while it holds nothing."""
        self._origin += COUNTS * turns
        self._trajectory = self.place
        self._put(GOAL_POSITION, round(self.place))

    @property
    def place(self) -> float:
        """Position of the horn [counts], as its encoder has it."""
        return float(self._origin + self.row[PLACE] / self._unit + self.shift)

    @property
    def torque(self) -> bool:
        """Whether it holds its position."""
        return bool(self._get(TORQUE_ENABLE))

    @property
    def heard(self) -> bool:
        """Whether its watchdog has not stopped it."""
        return self._get(BUS_WATCHDOG) != -1

    def _get(self, item: Item) -> int:
        return item.decoded(self._table[item.address : item.address + item.size])

    def _put(self, item: Item, value: int) -> None:
        self._table[item.address : item.address + item.size] = item.encoded(value)

    def power_off(self) -> None:
        """Its plug is out: it neither answers nor holds anything."""
        self.silent_until = math.inf
        self._put(TORQUE_ENABLE, 0)

    def shut_down(self, error: int) -> None:
        """Report a hardware error, and let go until it is rebooted."""
        self._put(HARDWARE_ERROR, self._get(HARDWARE_ERROR) | error)
        self._put(TORQUE_ENABLE, 0)

    def drive(self, time: float, force: float) -> None:
        """Set goal and largest force of the simulated motor at a time [s]; `force` [N] is what it pulled with."""
        passed, self._time = time - self._time, time
        most = min(self._get(GOAL_CURRENT), self._get(CURRENT_LIMIT))
        current = round(self._sense * force / self._newton / MODELS[self._model].current_unit)
        hard = self.torque and most > 0 and abs(current) >= _OVERLOADED * most
        self._hard = self._hard + passed if hard else 0.0
        if self._hard > _BEARS:
            self.shut_down(OVERLOAD)
        if self.temperature >= self._get(TEMPERATURE_LIMIT):
            self.shut_down(OVERHEATING)
        watchdog = self._get(BUS_WATCHDOG)
        if watchdog > 0 and self.torque and time - self._heard > watchdog * WATCHDOG_UNIT:
            self._put(BUS_WATCHDOG, -1)
            self._put(GOAL_POSITION, round(self.place))
            self._put(PROFILE_VELOCITY, 0)
        goal, profile = float(self._get(GOAL_POSITION)), self._get(PROFILE_VELOCITY)
        far = profile * VELOCITY_UNIT * COUNTS / math.tau * passed if profile else math.inf
        if self.torque:
            self._trajectory += min(far, max(-far, goal - self._trajectory))
        else:
            self._trajectory = self.place
        position_loop = self.torque and self._get(OPERATING_MODE) == CURRENT_BASED_POSITION
        self.row[CLOSED] = float(position_loop)
        self.row[GOAL] = (self._trajectory - self.shift - self._origin) * self._unit
        self.row[MOST] = most * MODELS[self._model].current_unit * self._newton
        if not self.frozen:
            self._put(PRESENT_CURRENT, current)
            self._put(PRESENT_POSITION, round(self.place))
            self._put(PRESENT_VELOCITY, round(self.row[1] / self._unit * math.tau / COUNTS / VELOCITY_UNIT))
        self._put(PRESENT_TEMPERATURE, min(255, round(self.temperature)))
        self._put(REALTIME_TICK, round(1e3 * (time - self._booted)) % TICKS)

    def read(self, address: int, size: int) -> bytes:
        """Bytes of the control table; indirect data are those of their addresses."""
        return bytes(self._table[self._direct(address + k)] for k in range(size))

    def _direct(self, address: int) -> int:
        k = address - INDIRECT_DATA[0]
        return self._get(Item(INDIRECT_ADDRESS + 2 * k, 2)) if 0 <= k < _INDIRECT else address

    def write(self, address: int, data: bytes) -> int:
        """Write bytes; the error of the status packet."""
        end = address + len(data)
        if end > len(self._table):
            return ACCESS_ERROR
        if self.torque and (address < _EEPROM or INDIRECT_ADDRESS <= address < INDIRECT_ADDRESS + 2 * _INDIRECT):
            return ACCESS_ERROR
        if any(address < item.address + item.size and item.address < end for item in _READ_ONLY):
            return ACCESS_ERROR
        if address == TORQUE_ENABLE.address and data[0] and self._get(HARDWARE_ERROR):
            return 1
        for item in _GOALS:
            if address == item.address and len(data) == item.size:
                goal = item.decoded(data)
                most = self._get(CURRENT_LIMIT) if item is GOAL_CURRENT else FURTHEST
                if self._get(BUS_WATCHDOG) == -1:
                    return RANGE_ERROR
                if abs(goal) > most:
                    return LIMIT_ERROR
        self._table[address:end] = data
        if address == OPERATING_MODE.address:
            self._put(GOAL_POSITION, round(self.place))
        if address == TORQUE_ENABLE.address and data[0]:
            self._trajectory = self.place
        return 0

    def answer(self, number: int, instruction: int, parameters: bytes, time: float) -> tuple[float, bytes] | None:
        """Answer to a packet at a time [s], and how long after it it begins [s]; None where there is none."""
        if time < self.silent_until or number not in (self.number, BROADCAST):
            return None
        self._heard = time
        delay = 2e-6 * self._get(RETURN_DELAY)
        word = [int.from_bytes(parameters[k : k + 2], "little") for k in (0, 2)]
        if instruction == PING:
            data = self.read(0, 2) + self.read(6, 1)
            return delay + 1e-3 * self.number * (number == BROADCAST), self._status(0, data)
        if instruction == SYNC_WRITE and number == BROADCAST:
            address, size = word
            for k in range(4, len(parameters), size + 1):
                if parameters[k] == self.number and k + 1 + size <= len(parameters):
                    self.write(address, parameters[k + 1 : k + 1 + size])
            return None
        if number == BROADCAST:
            return None
        if instruction == READ:
            return delay, self._status(0, self.read(*word))
        if instruction == WRITE:
            return delay, self._status(self.write(word[0], parameters[2:]), b"")
        if instruction == REBOOT:
            told = self._status(0, b"")
            self._wake(time)
            self.silent_until = time + _REBOOT
            return delay, told
        return delay, self._status(INSTRUCTION_ERROR, b"")

    @property
    def error(self) -> int:
        """Error of a status packet where all else is well: the alert."""
        return ALERT if self._get(HARDWARE_ERROR) else 0

    def _status(self, error: int, data: bytes) -> bytes:
        return packet(self.number, STATUS, bytes([error | self.error]) + data)
