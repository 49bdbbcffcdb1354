"""Draws the pictures of a bench in real time, in a thread of its own beside the board's."""

from __future__ import annotations

import queue
import threading
import time

from wristctl.hardware.bench.camera import Exposure, Painter, Shutter
from wristctl.hardware.bench.frame_memory import FrameMemory


class Film:
    """Draws exposures, and puts each picture into the memory when it arrives; late, it leaves pictures out."""

    def __init__(self, shutter: Shutter, painter: Painter, memory: FrameMemory) -> None:
        self._shutter, self._painter, self._memory = shutter, painter, memory
        self._exposed: queue.SimpleQueue[tuple[Exposure, float] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._develop, name="film", daemon=True)
        self._thread.start()

    def expose(self, exposure: Exposure, start: float) -> None:
        """Draw this soon; the exposure's clock was 0 at `start` of `time.monotonic`."""
        self._exposed.put((exposure, start))

    def close(self) -> None:
        """End the thread."""
        self._exposed.put(None)
        self._thread.join()

    def _develop(self) -> None:
        while (taken := self._exposed.get()) is not None:
            exposure, start = taken
            arrival = start + exposure.time + self._shutter.delay
            if time.monotonic() > arrival and not self._exposed.empty():
                continue
            frame = self._shutter.picture(exposure, self._painter)
            time.sleep(max(0.0, arrival - time.monotonic()))
            self._memory.write(frame._replace(time=start + frame.time))
