"""The camera before the emulated bench: which frames it takes, what they show, and when they arrive."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from wristctl.config.bench import RenderedCamera
from wristctl.hardware.bench.faults import Faults
from wristctl.hardware.bench.wrist import BenchWrist
from wristctl.hardware.vision.camera import Frame, Image

Array = NDArray[np.float64]

_SMEAR, _MOST_INSTANTS = np.deg2rad(0.25), 8
"""Turn of the last disc between two instants that are drawn of one exposure, and how many are drawn at most."""


class Painter(Protocol):
    """What draws the wrist: `vision.scene.Scene`."""

    def render(self, theta: Array, rng: np.random.Generator, covered: bool = False, swapped: bool = False) -> Image:
        """The picture of segment angles (k, n) at k instants of the exposure."""


class Exposure(NamedTuple):
    """All that a frame's picture is made of; what a frozen camera shows is another frame's."""

    number: int
    time: float
    """middle of the exposure [s]"""
    shown: int
    theta: Array
    """(k, n) at k instants [rad]"""
    covered: bool
    swapped: bool


class Shutter:
    """Takes frame number k at k/frame_rate on the board's clock. Each frame has a random stream of its own."""

    def __init__(self, settings: RenderedCamera, faults: Faults, wrist: BenchWrist, seed: int) -> None:
        self._settings, self._faults, self._wrist, self._seed = settings, faults, wrist, seed

    @property
    def delay(self) -> float:
        """From the middle of an exposure to the frame's arrival [s]."""
        return self._settings.delay_frames / self._settings.frame_rate

    def newest(self, delay: float) -> int:
        """The newest frame whose exposure is over, and its middle `delay` s past; negative where there is none."""
        past = max(delay, 0.5 * self._settings.exposure)
        return math.floor((self._wrist.time - past) * self._settings.frame_rate + 1e-9)

    def arrives(self, number: int) -> bool:
        """Whether this frame gets through."""
        dropped = self._stream(number).random() < self._settings.dropped
        return not (dropped or self._faults.on("frames-dropped", self._time(number)))

    def expose(self, number: int) -> Exposure:
        """What this frame is made of; its exposure is over, and not longer ago than the wrist remembers."""
        time = self._time(number)
        frozen = self._faults.since("camera-frozen", time)
        shown = number if frozen is None else math.floor(frozen * self._settings.frame_rate)
        at = self._time(shown)
        half = 0.5 * self._settings.exposure
        ends = self._wrist.angles(np.array([at - half, at + half]))
        turned = abs(ends.sum(axis=1) @ [-1.0, 1.0])
        count = min(_MOST_INSTANTS, 1 + math.ceil(turned / _SMEAR))
        instants = at + half * (2.0 * np.arange(count) + 1.0 - count) / count
        covered, swapped = (self._faults.on(kind, at) for kind in ("marker-covered", "markers-swapped"))
        return Exposure(number, time, shown, self._wrist.angles(instants), covered, swapped)

    def picture(self, exposure: Exposure, painter: Painter) -> Frame:
        """Draw it; of one `shown` frame always the same."""
        rng = self._stream(exposure.shown)
        rng.random()  # decided whether it arrives
        image = painter.render(exposure.theta, rng, covered=exposure.covered, swapped=exposure.swapped)
        return Frame(image, exposure.time, exposure.number)

    def _time(self, number: int) -> float:
        return number / self._settings.frame_rate

    def _stream(self, number: int) -> np.random.Generator:
        return np.random.default_rng([self._seed, number])
