"""The bench's line in real time, and what may go wrong on it."""

from __future__ import annotations

import time
from collections.abc import Callable

from wristctl.bench.fault_injection import Faults
from wristctl.board.emulator.serve import Line

_AT_ONCE = 1e-3
"""A latency timer [s] that is no longer than this is that of USB itself: nothing is held back."""


class FaultyLine:
    """Another line with faults: port-lost, for good, and host-silent; `clock` is the board's.

    What the board says is handed over every `latency_timer` seconds of it, by `pass_on`.
    """

    def __init__(self, line: Line, faults: Faults, clock: Callable[[], float], latency_timer: float = 0.0) -> None:
        self.address = line.address
        self.there = False
        """Whether a client is there."""
        self.heard: float | None = None
        """When the board was last sent something [s on its clock]; None: never."""
        self._line, self._faults, self._clock = line, faults, clock
        self._lost = False
        self._latency_timer, self._held, self._due = latency_timer, b"", 0.0

    def wait(self, timeout: float) -> bool:
        """Wait until there may be bytes, at most `timeout` s; whether a client is there."""
        if not self._lost and self._faults.on("port-lost", self._clock()):
            self.close()
        if self._lost:
            time.sleep(timeout)  # the board still has its power: it is not to be reset
        else:
            self.there = self._line.wait(timeout)
        return self.there

    def receive(self) -> bytes:
        """What clients have sent, as far as the board hears it."""
        received = b"" if self._lost else self._line.receive()
        if not received or self._faults.on("host-silent", self._clock()):
            return b""
        self.heard = self._clock()
        return received

    def send(self, data: bytes) -> None:
        """Give bytes to every client, once their time has come."""
        if not self._held:
            timer = self._latency_timer
            self._due = (self._clock() // timer + 1) * timer if timer > _AT_ONCE else 0.0
        self._held += data
        self.pass_on()

    def pass_on(self) -> None:
        """Hand over what is held, if it is time."""
        if self._held and not self._lost and self._clock() >= self._due:
            self._line.send(self._held)
            self._held = b""

    def close(self) -> None:
        """Send the clients away."""
        if not self._lost:
            self._lost = True
            self._line.close()
