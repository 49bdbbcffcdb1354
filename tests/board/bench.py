"""A motor board on the bench: any emulated chip that runs the image, four watched drives, and a host that asks."""

from __future__ import annotations

import binascii
from typing import Any, Protocol

import numpy as np

from tests.board.drive_watch import CLOCK, DriveWatch
from wristctl.board.layout import ANSWER_TO, BOUND, COMMAND_OF, LAYOUTS
from wristctl.board.messages import (
    BAUD,
    ENABLE_KEY,
    Command,
    Configure,
    Connect,
    Enable,
    Flag,
    Home,
    Limits,
    Result,
    Status,
)

MS = CLOCK // 1000


class Chip(Protocol):
    """An emulated ATmega2560 in virtual time."""

    @property
    def cycles(self) -> int: ...
    def run(self, cycles: int) -> None: ...
    def write(self, data: bytes) -> None: ...
    def read(self) -> bytes: ...
    def pin(self, port: str, bit: int) -> bool: ...
    def drive(self, port: str, bit: int, level: bool) -> None: ...
    def events(self) -> np.ndarray[Any, Any]: ...
    def jump(self, address: int) -> int: ...
    def poke(self, address: int, value: int) -> None: ...
    def reset(self) -> None: ...
    def close(self) -> None: ...


def encode(code: int, seq: int, payload: bytes = b"") -> bytes:
    """Return a frame, written independently of the package's own encoder."""
    body = bytes([code, seq]) + payload
    body += binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "big")
    return b"\0" + b"".join(bytes([len(part) + 1]) + part for part in body.split(b"\0")) + b"\0"


def decode(stuffed: bytes) -> tuple[int, int, bytes]:
    """Return code, seq and payload of the bytes between two delimiters."""
    out, at = b"", 0
    while at < len(stuffed):
        out += stuffed[at + 1 : at + stuffed[at]] + b"\0"
        at += stuffed[at]
    body, crc = out[:-3], out[-3:-1]
    assert binascii.crc_hqx(body, 0xFFFF) == int.from_bytes(crc, "big"), "the board sent a frame with a wrong CRC"
    return body[0], body[1], body[2:]


class Bench:
    """Runs a chip in virtual time; what its pins do is seen by four watched drives."""

    def __init__(self, chip: Chip) -> None:
        self.chip = chip
        self._drives = [DriveWatch(axis) for axis in range(4)]
        self._seq = 0
        self._line_busy_until = 0
        self._received = b""
        self.run_ms(20)
        self.connection = 0
        self.configure, self.limits = Configure(), Limits()
        self.connect()

    def connect(self) -> None:
        """Begin a connection of our own."""
        self.connection = (self.do(Command.HELLO).connection + 1) % 2**16
        self.do(Connect(self.connection))

    @property
    def enable(self) -> Enable:
        """The command, with its key and the check of what the board was told."""
        told = b"".join(LAYOUTS[type(each)].pack(each) for each in (self.configure, self.limits))
        return Enable(ENABLE_KEY, binascii.crc_hqx(told, 0xFFFF))

    def frame(self, command: int, seq: int, payload: bytes = b"", connection: int | None = None) -> bytes:
        """A command of our connection, or of another, as it goes over the wire."""
        number = self.connection if connection is None else connection
        return encode(command, seq, number.to_bytes(2, "little") * (command in BOUND) + payload)

    def run(self, cycles: int) -> None:
        self.chip.run(cycles)

    def run_ms(self, ms: float) -> None:
        self.run(round(ms * MS))

    def look(self) -> list[np.ndarray[Any, Any]]:
        """Let the drives see what the pins did; return each axis's cycles of rising STEP edges since the last look."""
        events = self.chip.events()
        return [drive.read(events) for drive in self._drives]

    @property
    def drives(self) -> list[DriveWatch]:
        self.look()
        return self._drives

    def frames(self) -> list[tuple[int, int, bytes]]:
        """Return code, seq and payload of the frames that have come in."""
        *whole, self._received = (self._received + self.chip.read()).split(b"\0")
        return [decode(part) for part in whole if part]

    def send(self, message: Command | tuple[Any, ...], seq: int | None = None) -> tuple[Command, int, int]:
        """Queue a command; return it, its sequence number and the cycle at which its last byte is in."""
        command = message if isinstance(message, Command) else COMMAND_OF[type(message)]
        payload = b"" if isinstance(message, Command) else LAYOUTS[type(message)].pack(message)
        self._seq = (self._seq + 1) % 256 if seq is None else seq
        data = self.frame(command, self._seq, payload)
        self.chip.write(data)
        self._line_busy_until = max(self.chip.cycles, self._line_busy_until) + len(data) * 10 * CLOCK // BAUD
        return command, self._seq, self._line_busy_until

    def ask(self, message: Command | tuple[Any, ...]) -> tuple[Result, Any]:
        """Send a command and run until it is answered; return the result and the answer's message (None for PING)."""
        command, seq, _ = self.send(message)
        for _ in range(200):
            self.run_ms(0.1)
            for code, answered, payload in self.frames():
                if (code, answered) == (command | 0x80, seq):
                    kind = ANSWER_TO.get(command)
                    answer = LAYOUTS[kind].unpack(kind, payload[1:]) if kind else None
                    return Result(payload[0]), answer
        raise AssertionError(f"{command.name} was not answered within 20 ms")

    def do(self, message: Command | tuple[Any, ...]) -> Any:
        """Ask, and insist on OK."""
        result, answer = self.ask(message)
        assert result is Result.OK, f"{message}: {result.name}, {answer}"
        self.heed(message)
        return answer

    def heed(self, message: Command | tuple[Any, ...]) -> None:
        """What the board has been told of its settings."""
        if isinstance(message, Configure):
            self.configure = message
        elif isinstance(message, Limits):
            self.limits = message

    def status(self) -> Status:
        answer: Status = self.do(Command.STATUS)
        return answer

    def get_ready(self) -> None:
        """Enable, let the drives settle, and declare this home."""
        self.do(self.enable)
        while Flag.SETTLING in self.status().flags:
            self.do(Command.PING)
            self.run_ms(10)
        self.do(Home(tuple(drive.position for drive in self.drives)))  # type: ignore[arg-type]

    def wait_for_rest(self) -> Status:
        """Keep the link alive until no axis moves."""
        patience = self.chip.cycles + 30 * CLOCK
        while Flag.MOVING in (status := self.status()).flags:
            assert self.chip.cycles < patience, f"still moving after 30 s: {status}"
            self.do(Command.PING)
            self.run_ms(5)
        return status

    def last_step(self) -> int:
        """Return the cycle of the latest rising edge on any axis."""
        return max(drive.last_rise for drive in self.drives)

    def drives_energised(self) -> list[bool]:
        return [not self.chip.pin("C", axis) for axis in range(4)]

    def assert_drives_content(self) -> None:
        """No DM542 timing was violated and no step came while a drive was off."""
        for axis, drive in enumerate(self.drives):
            assert drive.violations() == {}, f"axis {axis}"
            assert drive.steps_while_off == 0, f"axis {axis}"
