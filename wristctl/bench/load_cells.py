"""Load cells of the emulated bench: what their amplifiers have converted of the true pulls at the spools."""

import math

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.faults import Faults
from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES
from wristctl.config.bench import EmulatedCells
from wristctl.seeds import Entropy

# Conversions over which an amplifier takes the mean: 50 ms at 80 per second, as its data sheet has the settling.
_MEAN_OF = 4
_COUNT = 256
_GRAVITY = 9.80665


class LoadCells:
    """Four amplifiers on a chip's pins, which convert by clocks of their own. `stream` draws their noise."""

    def __init__(self, settings: EmulatedCells, chip: Atmega2560, faults: Faults, stream: Entropy) -> None:
        self._settings, self._chip, self._faults = settings, chip, faults
        self._noise = [np.random.default_rng((*stream, axis)) for axis in range(AXES)]
        self._periods = [round(FREQUENCY / (settings.rate * (1.0 + error))) for error in settings.clock_error]
        self._due = [chip.cycles + _MEAN_OF * period for period in self._periods]
        self.hanging = np.zeros(AXES)
        """Masses that hang on the cells beside their tendons, (4,) [kg]."""
        for axis in range(AXES):
            chip.fit_amplifier(axis, True)

    @property
    def next(self) -> int:
        """Cycle at which the next conversion ends."""
        return min(self._due)

    def convert(self, wrist: BenchWrist) -> None:
        """End the conversions that are due, of a wrist that has followed the chip."""
        now = self._chip.cycles
        for axis, period in enumerate(self._periods):
            while self._due[axis] <= now:
                self._convert(axis, self._due[axis] - _MEAN_OF * period, self._due[axis], wrist)
                self._due[axis] += period

    def _convert(self, axis: int, begun: int, ended: int, wrist: BenchWrist) -> None:
        settings, unplugged = self._settings, self._faults.active(("cell-unplugged",), ended / FREQUENCY)
        self._chip.fit_amplifier(axis, all(fault.axis != axis for fault in unplugged))
        pull = _mean_pull(wrist, axis, begun / FREQUENCY, ended / FREQUENCY) + _GRAVITY * self.hanging[axis]
        noise = settings.noise * self._noise[axis].standard_normal()
        counts = settings.offset[axis] + settings.counts_per_newton[axis] * pull + noise
        self._chip.convert(axis, round(_COUNT * counts), begun)


def _mean_pull(wrist: BenchWrist, axis: int, begun: float, ended: float) -> float:
    truth = wrist.truth(begun)
    during: Array = truth.pull[truth.time <= ended + 1e-9, axis]
    return float(during.mean()) if len(during) else math.nan
