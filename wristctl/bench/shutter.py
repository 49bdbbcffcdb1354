"""The shutter of the bench's camera: which frames it takes, what they show, and when they arrive."""

from __future__ import annotations

import math

import numpy as np

from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.exposure import Exposure
from wristctl.bench.fault_injection import Faults
from wristctl.bench.picture_faults import PICTURE_FAULTS
from wristctl.config.bench import RenderedCamera
from wristctl.seeds import Entropy

_SMEAR, _MOST_INSTANTS, _WITHIN = np.deg2rad(0.25), 8, 8
"""Turn of the last disc (about half a pixel of its marker's way) for which a part of the exposure is drawn, and how
many are drawn at most; moments whose mean a part shows."""


class Shutter:
    """Takes frame number k at k/frame_rate on the board's clock. Each frame has a random stream of its own.

    From a trial's start on frames count anew, in the trial's own stream: trials of the same scenario and repetition
    meet the same noise, whatever was done before them.
    """

    def __init__(self, settings: RenderedCamera, faults: Faults, wrist: BenchWrist, stream: Entropy) -> None:
        self._settings, self._faults, self._wrist = settings, faults, wrist
        self._streams = [(0, stream)]  # the first frame of each, and whose it is

    def begin(self, start: float, stream: Entropy) -> None:
        """Frames from `start` [s] on belong to this stream."""
        self._streams.append((math.ceil(start * self._settings.frame_rate - 1e-9), stream))

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
        dropped = np.random.default_rng(self._noise(number)).random() < self._settings.dropped
        faults, time = self._faults, self._time(number)
        thinned = any(number % round(each.size) for each in faults.active(("frames-thinned",), time))
        return not (dropped or thinned or faults.on("frames-dropped", time))

    def expose(self, number: int) -> Exposure:
        """What this frame is made of; its exposure is over, and not longer ago than the wrist remembers."""
        faults, time = self._faults, self._time(number)
        shown = self._shown(number, time)
        late = sum(each.size for each in faults.active(("pictures-late",), time))
        at = self._time(shown) - late
        half = 0.5 * self._settings.exposure
        ends = self._wrist.angles(np.array([at - half, at + half]))
        turned = abs(float(np.diff(self._wrist.tip_angle(ends))[0]))
        count = min(_MOST_INSTANTS, max(1, math.ceil(turned / _SMEAR)))
        moments = at + half * np.linspace(-1.0, 1.0, 2 * count * _WITHIN + 1)[1::2]
        parts = self._wrist.angles(moments).reshape(count, _WITHIN, -1).mean(axis=1)
        covered, swapped = (faults.on(kind, at) for kind in ("marker-covered", "markers-swapped"))
        turned = math.radians(sum(each.size for each in faults.active(("marker-turned",), at)))
        spoiled = tuple((each.kind, each.size) for each in faults.active(PICTURE_FAULTS, time))
        across = self._wrist.across(at)
        stamp = self._stamp(time)
        return Exposure(
            number, stamp, shown, parts, covered, swapped, self._noise(shown), across, turned, spoiled
        )  # fmt: skip

    def _shown(self, number: int, time: float) -> int:
        """The frame whose picture this one shows."""
        shown = [number]
        for each in self._faults.active(("camera-frozen", "camera-frozen-clock", "camera-repeats"), time):
            first = math.floor(self._faults.begun(each) * self._settings.frame_rate)
            shown.append(first - (number % round(each.size) if each.kind == "camera-repeats" else 0))
        return min(shown)

    def _stamp(self, time: float) -> float:
        stuck = self._faults.since("stamps-stuck", time)
        return (time if stuck is None else stuck) + sum(
            each.size for each in self._faults.active(("stamps-shifted",), time)
        )

    def _noise(self, number: int) -> Entropy:
        first, stream = next(each for each in reversed(self._streams) if each[0] <= number)
        return *stream, number - first

    def _time(self, number: int) -> float:
        return number / self._settings.frame_rate
