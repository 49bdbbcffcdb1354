"""What the bench in real time leaves behind of what its board did: a small file that outlives every client."""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path

from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.line import FaultyLine
from wristctl.bench.motors import PERIOD

SCHEMA = "wristctl.bench/1"
_LEAST_INTERVAL = 0.05


class BenchRecord:
    """A JSON file, written anew when motors have moved or been switched, at most 20 times a second.

    Times are of `time.monotonic`; lists are by axis.
    """

    def __init__(self, path: Path, wrist: BenchWrist, line: FaultyLine) -> None:
        self._path, self._wrist, self._line = path, wrist, line
        self._written, self._last = -math.inf, wrist.motion

    def look(self, start: float) -> None:
        """Write if there is something new; the board's clock was 0 at `start`."""
        if time.monotonic() - self._written >= _LEAST_INTERVAL and self._wrist.motion != self._last:
            self.write(start, ended=False)

    def write(self, start: float, ended: bool) -> None:
        """Write, in one piece."""
        self._last, self._written = self._wrist.motion, time.monotonic()
        newest = self._wrist.truth(self._wrist.time - PERIOD)
        said = {
            "schema": SCHEMA,
            "ended": ended,
            "time": self._written,
            "last_heard": _moved(self._line.heard, start),
            "last_step": [_moved(at, start) for at in self._last.last_step],
            "steps": self._last.steps,
            "energised": self._last.energised,
            "theta": float(newest.angle[-1]),
            "pull": newest.pull.sum(axis=0).tolist(),
        }
        part = self._path.with_name(f".{self._path.name}.part")
        part.write_text(json.dumps(said, indent=2) + "\n")
        os.replace(part, self._path)


def _moved(time: float | None, start: float) -> float | None:
    return None if time is None else start + time
