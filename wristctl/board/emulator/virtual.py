"""The emulated board in virtual time: time passes only while the host waits, so that every run is the same."""

from __future__ import annotations

from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY


class VirtualTransport:
    """The wire to an emulated chip in the same process."""

    name = "emulated"
    boot_time = 0.0

    def __init__(self, chip: Atmega2560 | None = None) -> None:
        self.chip = chip or Atmega2560()

    def write(self, data: bytes) -> None:
        """Put bytes on the line."""
        self.chip.write(data)

    def read(self, timeout: float) -> bytes:
        """What the chip has sent; runs it for up to `timeout` s until there is something."""
        end = self.chip.cycles + max(1, round(timeout * FREQUENCY))
        while not (data := self.chip.read()) and self.chip.cycles < end:
            self.chip.run(end - self.chip.cycles, until_sent=True)
        return data

    def now(self) -> float:
        """Seconds on the chip's clock."""
        return self.chip.cycles / FREQUENCY

    def wait(self, seconds: float) -> None:
        """Run the chip for so long."""
        self.chip.run(round(seconds * FREQUENCY))

    def close(self) -> None:
        """Nothing to give back."""
