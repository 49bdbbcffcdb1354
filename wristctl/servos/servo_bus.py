"""A bus with Dynamixel servos, through the maker's `dynamixel-sdk`: settings read back, goals and status of all.

What the rig asks every tick stands side by side in each servo's indirect data, so that one exchange reads it all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

from wristctl.errors import UserError
from wristctl.rig import Fault, Lost
from wristctl.servos.x_series import (
    BUS_WATCHDOG,
    GOAL_POSITION,
    HARDWARE_ERROR,
    INDIRECT_ADDRESS,
    INDIRECT_DATA,
    MODEL_NUMBER,
    MODELS,
    PRESENT_CURRENT,
    PRESENT_POSITION,
    PRESENT_TEMPERATURE,
    REALTIME_TICK,
    TORQUE_ENABLE,
    Item,
    Model,
)

# What a status holds, in its order.
_READ = (
    MODEL_NUMBER, TORQUE_ENABLE, HARDWARE_ERROR, BUS_WATCHDOG, PRESENT_TEMPERATURE, REALTIME_TICK, PRESENT_CURRENT,
    PRESENT_POSITION,
)  # fmt: skip
_SIZE = sum(item.size for item in _READ)
# Bytes around the data of an answer, and around those of each servo in the one answer to a fast read; where in an
# answer its id is, and where its data begin.
_AROUND, _EACH, _ID, _DATA = 11, 4, 4, 9
# Seconds for which an answer is waited for until it is known how quickly they come; tries of what has to succeed.
_PATIENT, _TRIES = 0.04, 4
# Least time for which an answer is waited for [s].
_LEAST = 3e-3
# Longest wait for bytes at a port [s].
_POLL = 2e-4
# Exchanges that are timed, reads that may collide, and how many of those that do tell of two servos.
_TIMED, _COLLIDED = 12, 3


class Status(NamedTuple):
    """What one servo says of itself."""

    model: int
    torque: int
    """1 where it holds its position."""
    error: int
    """Hardware Error Status."""
    watchdog: int
    """-1 where it has stopped because it heard nothing."""
    temperature: int
    """[degrees Celsius]"""
    tick: int
    """Its own clock [ms]."""
    current: int
    """[units of the model], positive toward larger positions."""
    position: int
    """[counts]"""


def _decoded(data: bytes) -> Status:
    values, at = list[int](), 0
    for item in _READ:
        values.append(item.decoded(data[at : at + item.size]))
        at += item.size
    return Status(*values)


def sdk() -> Any:
    """The maker's library. UserError where it is not installed."""
    try:
        return import_module("dynamixel_sdk")
    except ImportError:
        raise UserError("dynamixel-sdk is not installed", "servos", "pip install 'wristctl[servos]'") from None


def packet_handler() -> Any:
    """The SDK's packets of the protocol 2.0."""
    handler: Any = sdk().Protocol2PacketHandler

    class Packets(handler):  # type: ignore[misc]
        """The SDK 4.1 sends packets without the bytes that it stuffs, and takes some out that are none."""

        def addStuffing(self, packet: list[int]) -> list[int]:
            packet[:] = super().addStuffing(packet)
            return packet

        def removeStuffing(self, packet: list[int]) -> list[int]:
            body = bytes(packet[7:-2]).replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
            return [*packet[:5], *(len(body) + 2).to_bytes(2, "little"), *body, *packet[-2:]]

    return Packets()


class ServoBus:
    """Servos with these ids on a port of the SDK's kind.

    Raises Lost for what does not answer, Fault for a setting that a servo does not take.
    """

    def __init__(self, port: Any, ids: Sequence[int], name: str) -> None:
        maker = sdk()
        self._port, self._ids, self._name = port, tuple(ids), name
        self._packets, self._fine, self._garbled = packet_handler(), maker.COMM_SUCCESS, maker.COMM_RX_CORRUPT
        self._data, self._fast = INDIRECT_DATA[0], True
        self.models: dict[int, Model] = {}
        port.patience = _PATIENT

    def find(self) -> None:
        """See that every id answers, once, and is of a model that takes a current."""
        if missing := [number for number in self._ids if not self._pinged(number)]:
            raise Lost(self._missing(missing))
        for number in self._ids:
            reads = [self._tried(number, REALTIME_TICK.address, 27)[1] for _ in range(2 * _COLLIDED)]
            if reads.count(self._garbled) >= _COLLIDED:
                raise Lost(f"answers of id {number} collide: two servos on {self._name} have this id")
            model = self.value(number, MODEL_NUMBER)
            if model not in MODELS:
                raise Fault(f"servo {number}, model {model}, limits no current: X series but XL430 and XC430 do")
            self.models[number] = MODELS[model]

    def _pinged(self, number: int) -> bool:
        for _ in range(_TRIES):
            _, result, _ = self._packets.ping(self._port, number)
            if result == self._fine:
                return True
            if result == self._garbled:
                raise Lost(f"answers of id {number} collide: two servos on {self._name} have this id")
        return False

    def _missing(self, missing: Sequence[int]) -> str:
        found = sorted(self._packets.broadcastPing(self._port)[0])
        which = ", ".join(map(str, missing))
        if not found:
            return (
                f"no servo answers on {self._name} at {self._port.getBaudRate()} baud: see its power, its plugs and "
                "the servos' Baud Rate"
            )
        there = ", ".join(map(str, found))
        return f"no servo answers as id {which} on {self._name}; there are {there}: see its plugs and its id"

    def answering(self) -> list[int]:
        """Ids that answer now."""
        return [number for number in self._ids if self.pinged(number) or self.pinged(number)]

    def _tried(self, number: int, address: int, size: int) -> tuple[bytes, int]:
        self._packets.readTx(self._port, number, address, size)
        return self._answer(number, size)

    def _answer(self, number: int, size: int) -> tuple[bytes, int]:
        """Data of a servo's answer to a read, and the SDK's result; one of another size is to an earlier question."""
        while True:
            packet, result = self._packets.rxPacket(self._port, False)
            if result != self._fine or (packet[_ID] == number and len(packet) == size + _AROUND):
                return bytes(packet[_DATA : _DATA + size]), result

    def _bytes(self, number: int, address: int, size: int) -> bytes:
        for _ in range(_TRIES):
            data, result = self._tried(number, address, size)
            if result == self._fine:
                return data
        raise Lost(f"servo {number} does not answer on {self._name}")

    def value(self, number: int, item: Item) -> int:
        """Value of an item."""
        return item.decoded(self._bytes(number, item.address, item.size))

    def set(self, number: int, item: Item, value: int, name: str) -> None:
        """Write a value and read it back. Raises Fault where the servo has another one then."""
        for _ in range(2):
            self._write(number, item.address, item.encoded(value))
            if (kept := self.value(number, item)) == value:
                return
        raise Fault(f"servo {number} takes {kept} as {name} ({item.address}) where {value} is written")

    def _write(self, number: int, address: int, data: bytes) -> None:
        for _ in range(_TRIES):
            result, _ = self._packets.writeTxRx(self._port, number, address, len(data), list(data))
            if result == self._fine:
                return

    def reboot(self, number: int) -> None:
        """Start a servo anew: its shutdown ends, its torque is off, its positions are those of one turn."""
        self._packets.reboot(self._port, number)

    def pinged(self, number: int) -> bool:
        """Whether a servo answers."""
        return bool(self._packets.ping(self._port, number)[1] == self._fine)

    def arrange(self) -> None:
        """Have each servo's status stand side by side in its indirect data. Its torque is off."""
        addresses = [item.address + k for item in _READ for k in range(item.size)]
        data = b"".join(address.to_bytes(2, "little") for address in addresses)
        begins = set[int]()
        for number in self._ids:
            self._write(number, INDIRECT_ADDRESS, data)
            if self._bytes(number, INDIRECT_ADDRESS, len(data)) != data:
                raise Fault(f"servo {number} does not take indirect addresses ({INDIRECT_ADDRESS}): renew its firmware")
            own = self._bytes(number, MODEL_NUMBER.address, MODEL_NUMBER.size)
            begins |= {next((begin for begin in INDIRECT_DATA if self._bytes(number, begin, len(own)) == own), 0)}
        if len(begins) > 1 or 0 in begins:
            raise Fault("the servos have their indirect data at different addresses: renew their firmware")
        (self._data,) = begins

    def measure(self, clock: Callable[[], float]) -> float:
        """Median time of an exchange [s], by which answers are waited for from here on. Raises Lost where none comes.

        Old firmware does not know the fast read; then each servo answers by itself.
        """
        for self._fast in (True, False):
            times = list[float]()
            for _ in range(_TIMED):
                begin = clock()
                if self.status() is not None:
                    times.append(clock() - begin)
            if len(times) > _TIMED // 2:
                median = sorted(times)[len(times) // 2]
                self._port.patience = max(_LEAST, 1.5 * median)
                return median
        raise Lost(f"the servos on {self._name} do not answer when all are asked at once")

    def follow(self, positions: Sequence[int]) -> None:
        """Have all servos go to these positions [counts], by one packet that none answers."""
        data = list[int]()
        for number, position in zip(self._ids, positions, strict=True):
            data += [number, *GOAL_POSITION.encoded(position)]
        self._packets.syncWriteTxOnly(self._port, GOAL_POSITION.address, GOAL_POSITION.size, data, len(data))

    def release(self, number: int) -> None:
        """Take a servo's torque off, without waiting for its answer."""
        self._packets.writeTxOnly(self._port, number, TORQUE_ENABLE.address, 1, [0])

    def status(self) -> list[Status] | None:
        """Status of each servo, in the order of the ids; None where an answer was lost or spoilt."""
        ids, packets = list(self._ids), self._packets
        packets.syncReadTx(self._port, self._data, _SIZE, ids, len(ids), self._fast)
        if not self._fast:
            answers = [self._answer(number, _SIZE) for number in ids]
            return [_decoded(data) for data, _ in answers] if all(one[1] == self._fine for one in answers) else None
        data, result, _ = packets.fastSyncReadRx(self._port, 254, (_SIZE + _EACH) * len(ids))
        if result != self._fine or len(data) < (_SIZE + _EACH) * len(ids) - 2:
            return None
        found = dict[int, Status]()
        for k in range(len(ids)):
            begin = k * (_SIZE + _EACH)
            found[data[begin + 1]] = _decoded(bytes(data[begin + 2 : begin + 2 + _SIZE]))
        return [found[number] for number in ids] if found.keys() == set(ids) else None


def opened(name: str, baud: int) -> Any:
    """A serial port for the SDK that nobody else has open, and whose patience is in seconds.

    Raises UserError where the SDK is not installed, Lost where the port cannot be opened.
    """
    import serial

    handler: Any = sdk().PortHandler

    class Port(handler):  # type: ignore[misc]
        """The SDK's port; its own waits 34 ms for each answer, more than a tick."""

        patience = _PATIENT

        def setPacketTimeout(self, packet_length: int) -> None:
            self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 1e3 * self.patience)

    port = Port(name)
    try:
        if not port.setBaudRate(baud):
            raise UserError(f"{baud} baud is no rate of the SDK", name, "9600 to 4000000: 1000000")
        port.ser.exclusive, port.ser.timeout = True, _POLL
    except (OSError, serial.SerialException) as error:
        raise Lost(f"{name} cannot be opened: {error}") from error
    return port
