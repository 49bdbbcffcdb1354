"""The camera's own pictures as a video, with their times beside it: a recording that can be tracked anew."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting

COLUMNS = {
    "number": ("", "of the frame, as the camera counts"),
    "clock": ("s", "when it was taken: the middle of its exposure, on the run's one clock"),
}
"""Of the table beside the video, a row for each of its frames: unit and meaning."""


class Video:
    """A video as Motion JPEG, which every build of OpenCV can write; its first picture decides the size."""

    def __init__(self, file: Path, frame_rate: float) -> None:
        self._file, self._rate = file, frame_rate
        self._writer: cv2.VideoWriter | None = None

    def write(self, picture: NDArray[np.uint8]) -> None:
        """The next picture (height, width, 3)."""
        if self._writer is None:
            code = cv2.VideoWriter.fourcc(*"MJPG")
            self._writer = cv2.VideoWriter(str(self._file), code, self._rate, picture.shape[1::-1])
        self._writer.write(picture)

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.release()


class RawVideo:
    """`file` with the pictures as they came, and a table of the same name with their times."""

    def __init__(self, file: Path, frame_rate: float) -> None:
        self._video = Video(file, frame_rate)
        self._table = file.with_suffix(".csv").open("w", encoding="utf-8", buffering=1)
        self._table.write(",".join(COLUMNS) + "\n")

    def add(self, frame: Frame, sighting: Sighting) -> None:
        """The next frame, whatever was seen in it."""
        picture: Any = cv2.cvtColor(frame.image, cv2.COLOR_GRAY2BGR)
        self._video.write(picture)
        self._table.write(f"{frame.number},{frame.time!r}\n")

    def close(self) -> None:
        """Finish both files."""
        self._video.close()
        self._table.close()
