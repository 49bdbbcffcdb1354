"""Whether a camera's picture is news: drivers replay old buffers, and stamp pictures with times that cannot be."""

from __future__ import annotations

import math
import zlib
from collections import deque
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict

_REMEMBERED = 1.0
"""Seconds for which a picture is known again: longer than any ring of buffers lasts."""
_SAME = 1e-3
"""Pixels within which corners are the same. Noise moves those of a wrist at rest by ten times as much, all eight of
them, each in both directions, in every picture; a repeated one gives them to rounding."""
_CLOCKS = 1e-3
"""Seconds by which a time stamp may be ahead of the clock: both are rounded."""


class _Known(NamedTuple):
    came: float
    print: int
    corners: Array


class CameraTruth:
    """Judges one picture after the other; what is no news is no angle.

    A picture is known again by all its bytes, or by the corners of its markers, which stay the same where only a pixel
    or a clock in the picture changes.
    """

    def __init__(self) -> None:
        self._known: deque[_Known] = deque()
        self._time, self._number = -math.inf, -1

    def judge(self, frame: Frame, seen: Sighting) -> Sighting:
        """The same sighting, or one of verdict `stamp` or `frozen`; it says when the frame came."""
        while self._known and seen.came - self._known[0].came > _REMEMBERED:
            self._known.popleft()
        shown = _Known(seen.came, zlib.crc32(frame.image.tobytes()), seen.corners)
        repeated = any(_alike(each, shown) for each in self._known)
        self._known.append(shown)
        stamped = self._time < frame.time <= seen.came + _CLOCKS and self._number < frame.number
        self._time, self._number = max(self._time, min(frame.time, seen.came)), max(self._number, frame.number)
        if repeated:
            return seen._replace(theta=math.nan, verdict=SightingVerdict.FROZEN)
        return seen if stamped else seen._replace(theta=math.nan, verdict=SightingVerdict.STAMP)


def _alike(before: _Known, now: _Known) -> bool:
    if before.print == now.print:
        return True
    if not np.isfinite(now.corners[1]).all():
        return False
    moved = np.abs(now.corners - before.corners)
    return bool((moved[1] < _SAME).all() and not (moved[0] >= _SAME).any())
