"""The wire to a board: a serial port or a `socket://` address (the one place that knows pyserial)."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol

import serial
from serial.tools import list_ports

from wristctl.board.board_errors import BoardError, PortLost, PortUnusable
from wristctl.processes import check_hardware_allowed

# Seconds that a Mega's boot loader waits for a program after a reset, and some more.
BOOT_TIME = 2.0

# Seconds of one frame of USB at full speed, for whose next what the host writes waits.
_USB_FRAME = 1e-3

# USB adapters of Arduinos and their clones by vendor (Arduino has two).
ADAPTERS = {0x2341: "16U2", 0x2A03: "16U2", 0x1A86: "CH340", 0x0403: "FTDI", 0x10C4: "CP210x"}


class Transport(Protocol):
    """Bytes to and from a board, and the clock by which answers are late."""

    name: str
    boot_time: float
    """Seconds after opening in which the board may be starting, and must hear nothing: a byte would keep the Mega's
    boot loader waiting for a program."""

    def write(self, data: bytes) -> None:
        """Send."""

    def read(self, timeout: float) -> bytes:
        """Read the bytes that have come; waits up to `timeout` s for the first byte."""

    def now(self) -> float:
        """Seconds on a clock that only moves forward."""

    def wait(self, seconds: float) -> None:
        """Let time pass."""

    def close(self) -> None:
        """Give the wire back."""


class SerialTransport:
    """A board on a serial port, on Windows, Linux or macOS, or behind `socket://host:port`.

    Opening a port resets an Arduino. `exclusive` refuses a port that another program of this kind uses; `emulated`
    promises that a process of ours is at its other end.
    Raises PortUnusable, and UserError where no board may be opened.
    """

    def __init__(self, port: str, baud: int, exclusive: bool = True, emulated: bool = False) -> None:
        if not emulated:
            check_hardware_allowed("board", port)
        self.name = port
        only: dict[str, Any] = {"exclusive": True} if exclusive and "://" not in port else {}
        try:
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=1.0, **only)
        except (OSError, ValueError) as error:
            raise PortUnusable(port, error) from error
        self.boot_time = BOOT_TIME if self._resets_board() else 0.0

    def write(self, data: bytes) -> None:
        """Send. Raises PortLost."""
        with self._watched():
            self._serial.write(data)

    def read(self, timeout: float) -> bytes:
        """Read the bytes that have come; waits up to `timeout` s for the first byte. Raises PortLost."""
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

    def _resets_board(self) -> bool:
        """Whether it has modem lines, of which DTR resets an Arduino: sockets and pseudo-terminals have none."""
        try:
            return "://" not in self.name and self._serial.cts is not None
        except OSError:
            return False

    @contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except (OSError, TypeError) as error:  # TypeError: pyserial, of a port closed under it
            raise PortLost(self.name, error) from error


def underway(count: int, baud: int) -> float:
    """Mean time [s] from the host's writing of `count` bytes until the board has the last.

    They wait for the next frame of USB, of whose phase a host knows nothing: it may be half a frame more or less.
    """
    return 0.5 * _USB_FRAME + 10.0 * count / baud


class PortFound(NamedTuple):
    """A serial port of this computer."""

    device: str
    description: str
    serial_number: str
    board_like: bool  # made by someone who makes Arduinos or their serial chips
    adapter: str = ""  # one of ADAPTERS, empty for another


def ports() -> list[PortFound]:
    """The serial ports, those that may be a board first."""
    found_ports = [
        PortFound(
            port.device,
            port.description or "",
            port.serial_number or "",
            port.vid in ADAPTERS,
            ADAPTERS.get(port.vid, ""),
        )
        for port in list_ports.comports()
    ]
    return sorted(found_ports, key=lambda port: (not port.board_like, port.device))


# The name of the port that is no port: the emulated board in this process, in virtual time.
EMULATED = "emulated"


def open_transport(port: str | None, baud: int, exclusive: bool = True) -> Transport:
    """The wire to the board at `port`: a device, `socket://host:port` or `emulated`; None finds the only board.

    Raises PortUnusable, and BoardError where None finds no board or several.
    """
    if port == EMULATED:
        from wristctl.board.emulator.atmega2560 import VirtualTransport

        return VirtualTransport()
    return SerialTransport(port or only_board(), baud, exclusive)


def only_board() -> str:
    """The port of the only board plugged in. Raises BoardError where there is none, or more than one."""
    boards = [port.device for port in ports() if port.board_like]
    if len(boards) == 1:
        return boards[0]
    if boards:
        raise BoardError("host", f"several boards: {', '.join(boards)}", fix=f"--port {boards[0]}")
    fix = "plug it in, name it with --port (wristctl hw ports), or try without one: --port emulated"
    raise BoardError("host", "no board is plugged in", fix=fix)
