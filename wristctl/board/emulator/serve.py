"""The emulated board in real time, behind a pseudo-terminal or a TCP port, for any serial client.

As on a Mega, the first client to open the port resets the board.
"""

import contextlib
import logging
import os
import select
import socket
import time
from collections.abc import Callable
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from wristctl.board.emulator.atmega2560 import Atmega2560, Halted
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.errors import UserError
from wristctl.loop_priority import no_long_pauses

log = logging.getLogger(__name__)

_QUANTUM, _IDLE_QUANTUM = 0.00025, 0.02
# Bytes taken from clients in one go; bytes that wait for the chip before clients have to.
_AT_ONCE, _ON_THE_WAY = 4096, 1024
# Seconds that the chip may lag behind real time before that time is given up.
_FURTHEST_BEHIND = 0.1
# Seconds by which what the board says may be late as a mean, lest a rig's timing be another than it is set to.
_NOT_SEEN = 1e-3


class Line(Protocol):
    """The client's side of the board's serial line."""

    address: str

    def wait(self, timeout: float) -> bool:
        """Wait until there may be bytes, at most `timeout` s; whether a client is there."""

    def receive(self) -> bytes:
        """Receive the clients' bytes."""

    def send(self, data: bytes) -> None:
        """Give bytes to every client; what a client does not read is lost to it."""

    def close(self) -> None:
        """Send the clients away."""


class PtyLine:
    """A pseudo-terminal, on Linux and macOS: clients open `address` like a serial port."""

    def __init__(self) -> None:
        try:
            import pty
            import tty
        except ImportError as error:
            raise UserError("no pseudo-terminals here", fix="wristctl hw emulate --tcp 5000") from error
        self._master, client = pty.openpty()
        tty.setraw(client)
        self.address = os.ttyname(client)
        os.close(client)
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    def wait(self, timeout: float) -> bool:
        """Wait until there may be bytes, at most `timeout` s; whether a client is there."""
        select.select([self._master], [], [], timeout)  # to the microsecond; a poll waits for whole milliseconds
        events = self._poll.poll(0)
        if events and events[0][1] & select.POLLHUP:
            time.sleep(timeout)
            return False
        return True

    def receive(self) -> bytes:
        """Receive the client's bytes."""
        with contextlib.suppress(OSError):
            return os.read(self._master, _AT_ONCE)
        return b""

    def send(self, data: bytes) -> None:
        """Give bytes to the client."""
        with contextlib.suppress(OSError):
            os.write(self._master, data)

    def close(self) -> None:
        """Hang up."""
        os.close(self._master)


class TcpLine:
    """A TCP port on this computer, on any system: clients connect to `address`."""

    def __init__(self, port: int) -> None:
        try:
            self._server = socket.create_server(("127.0.0.1", port))
        except OSError as error:
            raise UserError(f"cannot listen ({error.strerror})", f"port {port}", "another port") from error
        self._server.setblocking(False)
        self.address = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._clients: list[socket.socket] = []

    def wait(self, timeout: float) -> bool:
        """Wait until there may be bytes, at most `timeout` s; whether a client is there."""
        select.select([self._server, *self._clients], [], [], timeout)
        with contextlib.suppress(BlockingIOError):
            client, _ = self._server.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients.append(client)
        return bool(self._clients)

    def receive(self) -> bytes:
        """Receive the bytes of all clients."""
        received = b""
        for client in list(self._clients):
            if len(received) >= _AT_ONCE:
                break
            try:
                data = client.recv(_AT_ONCE)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            if not data:
                self._clients.remove(client)
                client.close()
            received += data
        return received

    def send(self, data: bytes) -> None:
        """Give bytes to every client."""
        for client in self._clients:
            with contextlib.suppress(OSError):
                client.send(data)

    def close(self) -> None:
        """Close all connections."""
        for connection in (self._server, *self._clients):
            connection.close()


def serve(
    chip: Atmega2560,
    line: Line,
    running: Callable[[], bool] = lambda: True,
    watch: Callable[[NDArray[np.void], float], None] = lambda edges, start: None,
) -> None:
    """Run the chip in real time on this line for as long as `running` says; a program that crashes is reset.

    Clients that say more than the line carries have to wait, as at a real port.

    `watch` is told what the chip's latches did, and when its clock was 0 (`time.monotonic`): later where it lagged.
    """
    with no_long_pauses(), _Lateness() as lateness:
        start = time.monotonic() - chip.cycles / FREQUENCY
        connected = False
        while running():
            before, connected = connected, line.wait(_QUANTUM if connected else _IDLE_QUANTUM)
            if connected and not before:
                chip.reset()
            behind = time.monotonic() - start - chip.cycles / FREQUENCY
            start += max(0.0, behind - _FURTHEST_BEHIND)
            piece = max(0.0, min(behind, _FURTHEST_BEHIND))
            try:
                chip.run(round(piece * FREQUENCY))
            except Halted as crash:
                log.warning("the program on the emulated board crashed: %s; the board is reset", crash)
                chip.reset()
            if connected and chip.bytes_coming < _ON_THE_WAY:
                chip.write(line.receive())  # now that its clock is at the time at which they came
            elif connected:
                time.sleep(_QUANTUM)  # clients wait: bytes that are there end no poll
            if data := chip.read():
                line.send(data)
            if connected and before:
                lateness.ran(piece, behind - piece, time.monotonic() - start - chip.cycles / FREQUENCY)
            watch(chip.events(), start)


class _Lateness:
    """By how much later than on a real board a client hears what the chip says: it runs in pieces, each when its time
    has passed."""

    def __init__(self) -> None:
        self._served = self._late = self._worst = 0.0

    def ran(self, piece: float, given_up: float, after: float) -> None:
        """The chip ran a piece, time that has passed and is not given up, and was behind by `after` then, all in s."""
        self._served += piece
        self._late += piece * (0.5 * piece + after)
        self._worst = max(self._worst, piece + given_up + after)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Log it, as a warning where it matters."""
        if self._served == 0.0:
            return
        late, worst = 1e3 * self._late / self._served, 1e3 * self._worst
        said = f"the emulated board ran {late:.1f} ms late as a mean, {worst:.0f} ms at worst"
        if late > 1e3 * _NOT_SEEN or self._worst > _FURTHEST_BEHIND:
            log.warning("%s: this computer is too slow or too busy for what was measured on it", said)
        else:
            log.info(said)
