"""One frame in memory that two processes share: a file mapped by both, newest frame wins.

The counter before the frame is odd while the frame is being written (a seqlock): a reader that finds it odd, or
changed when it is done, has seen no frame, and finds the next.
"""

from __future__ import annotations

import mmap
from pathlib import Path

import numpy as np

from wristctl.vision.camera import Frame

_HEAD = np.dtype([*((name, np.int64) for name in ("writes", "number", "height", "width")), ("time", np.float64)])


class FrameMemory:
    """The frame in this file. One process writes; the file's maker gives the size of the pictures."""

    def __init__(self, path: Path, size: tuple[int, int] | None = None) -> None:
        if size is not None:
            head = np.zeros(1, _HEAD)
            head["height"], head["width"] = size
            path.write_bytes(head.tobytes() + bytes(size[0] * size[1]))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), 0)
        self._head = np.frombuffer(self._map, _HEAD, 1)
        shape = int(self._head["height"][0]), int(self._head["width"][0])
        self._image = np.frombuffer(self._map, np.uint8, offset=_HEAD.itemsize).reshape(shape)
        self._seen = 0

    def write(self, frame: Frame) -> None:
        """Put a frame in the place of the last."""
        self._head["writes"] += 1
        self._head["number"], self._head["time"] = frame.number, frame.time
        self._image[:] = frame.image
        self._head["writes"] += 1

    def newest(self) -> Frame | None:
        """The frame, if it is another one than at the last call. Never waits."""
        writes = int(self._head["writes"][0])
        if writes == self._seen or writes % 2:
            return None
        frame = Frame(self._image.copy(), float(self._head["time"][0]), int(self._head["number"][0]))
        if int(self._head["writes"][0]) != writes:
            return None
        self._seen = writes
        return frame


class SharedCamera:
    """The client's side of a camera in another process; times are of `time.monotonic`, which processes share."""

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self._memory = FrameMemory(path)

    def newest(self) -> Frame | None:
        """The newest frame that has arrived since the last call, None if none has."""
        return self._memory.newest()

    def close(self) -> None:
        """Nothing to give back: the memory goes with its file."""
