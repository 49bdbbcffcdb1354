"""The wire to a board: a serial port or a `socket://` address (the one place that knows pyserial)."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol

import serial
from serial.tools import list_ports

from wristctl.hardware.errors import PortLost, PortUnusable

_BOARD_VENDORS = {0x2341, 0x2A03, 0x1A86, 0x0403, 0x10C4}
"""USB vendors: Arduino (two), and the makers of the serial chips CH340, FT232 and CP210x."""


class Transport(Protocol):
    """Bytes to and from a board, and the clock by which answers are late."""

    name: str

    def write(self, data: bytes) -> None:
        """Send."""

    def read(self, timeout: float) -> bytes:
        """What has come; waits up to `timeout` s for the first byte."""

    def now(self) -> float:
        """Seconds on a clock that only moves forward."""

    def wait(self, seconds: float) -> None:
        """Let time pass."""

    def close(self) -> None:
        """Give the wire back."""


class SerialTransport:
    """A board on a serial port, on Windows, Linux or macOS, or behind `socket://host:port`.

    Opening a port resets an Arduino. `exclusive` refuses a port that another program of this kind uses.
    Raises PortUnusable.
    """

    def __init__(self, port: str, baud: int, exclusive: bool = True) -> None:
        self.name = port
        only: dict[str, Any] = {"exclusive": True} if exclusive and "://" not in port else {}
        try:
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=1.0, **only)
        except (OSError, ValueError) as error:
            raise PortUnusable(port, error) from error

    def write(self, data: bytes) -> None:
        """Send. Raises PortLost."""
        with self._watched():
            self._serial.write(data)

    def read(self, timeout: float) -> bytes:
        """What has come; waits up to `timeout` s for the first byte. Raises PortLost."""
        with self._watched():
            self._serial.timeout = timeout
            first: bytes = self._serial.read(1)
            if not first:
                return b""
            self._serial.timeout = 0
            return first + bytes(self._serial.read(4096))

    def now(self) -> float:
        """Seconds on the computer's monotonic clock."""
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Close the port."""
        self._serial.close()

    @contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except (OSError, TypeError) as error:  # TypeError: pyserial, of a port closed under it
            raise PortLost(self.name, error) from error


class PortFound(NamedTuple):
    """A serial port of this computer."""

    device: str
    description: str
    serial_number: str
    board_like: bool  # made by someone who makes Arduinos or their serial chips


def ports() -> list[PortFound]:
    """The serial ports, those that may be a board first."""
    found = [
        PortFound(each.device, each.description or "", each.serial_number or "", each.vid in _BOARD_VENDORS)
        for each in list_ports.comports()
    ]
    return sorted(found, key=lambda port: (not port.board_like, port.device))
