"""The wire to the bench's board in virtual time, and what may go wrong on it."""

from __future__ import annotations

import math

from wristctl.bench.fault_injection import Faults
from wristctl.board.board_errors import PortLost
from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.virtual import VirtualTransport


class BenchTransport(VirtualTransport):
    """The wire to an emulated chip in the same process, with faults: port-lost, board-reset and host-silent.

    A lost port stays lost; the board runs on, also while the host can only `wait`. What the board says is handed over
    every `latency_timer` seconds, by the board's USB chip.
    """

    def __init__(self, chip: Atmega2560, faults: Faults, latency_timer: float = 1e-3) -> None:
        super().__init__(chip)
        self._handed_over = round(latency_timer * FREQUENCY)
        self._faults, self._lost, self._reset = faults, False, -math.inf

    def write(self, data: bytes) -> None:
        """Put bytes on the line. Raises PortLost."""
        self._see_port()
        if not self._faults.on("host-silent", self.now()):
            super().write(data)

    def read(self, timeout: float) -> bytes:
        """What the chip has sent; runs it for up to `timeout` s until there is something. Raises PortLost."""
        self._see_port()
        end = self.chip.cycles + max(1, round(timeout * FREQUENCY))
        while not (data := self.chip.read()) and self.chip.cycles < end:
            self._run(min(end, (self.chip.cycles // self._handed_over + 1) * self._handed_over))
            self._see_port()
        return data

    def wait(self, seconds: float) -> None:
        """Run the chip for so long."""
        end = self.chip.cycles + round(seconds * FREQUENCY)
        while self.chip.cycles < end:
            self._run(end)

    def _run(self, end: int) -> None:
        """Run towards `end`, at most to the next reset that is due, and do that."""
        due = self._faults.next("board-reset", self._reset)
        cycle = math.inf if math.isinf(due) else round(due * FREQUENCY)
        self.chip.run(max(0, int(min(end, cycle)) - self.chip.cycles))
        if self.chip.cycles >= cycle:
            self.chip.reset()
            self._reset = due

    def _see_port(self) -> None:
        self._lost = self._lost or self._faults.on("port-lost", self.now())
        if self._lost:
            raise PortLost(self.name, OSError("injected fault"))
