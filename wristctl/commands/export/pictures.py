"""The pictures of a run's camera, at the times on the run's clock at which they were taken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wristctl.arrays import Array
from wristctl.records import Run
from wristctl.records.formats import read_table


@dataclass(frozen=True)
class Pictures:
    """A recorded film."""

    file: Path
    clock: Array
    """Middle of each exposure (N,) [s], in order."""

    @classmethod
    def of(cls, run: Run, name: str = "raw") -> Pictures | None:
        """A film of a run, whose times stand beside the pictures as they came; None where the run kept none."""
        times = f"data/{name.replace('video', 'raw')}.csv"
        if not (run.has(f"data/{name}.avi") and run.has(times)):
            return None
        clock = read_table(run.file(times)).clock.to_numpy(float)
        return cls(run.file(f"data/{name}.avi"), clock) if len(clock) else None

    def __iter__(self) -> Iterator[tuple[float, Any]]:
        """Time [s] and picture (height, width, 3) of each, as OpenCV reads them."""
        import cv2

        capture = cv2.VideoCapture(str(self.file))
        try:
            for second in self.clock.tolist():
                read, picture = capture.read()
                if not read:
                    return
                yield second, picture
        finally:
            capture.release()

    def write_mp4(self, file: Path, times: Array, rate: int) -> tuple[int, int] | None:
        """Write the last picture at each of the times (K,) [s] as a film of so many a second.

        Returns height and width; None where OpenCV was built without an encoder, or no picture can be read.
        """
        import cv2

        film: Any = None
        read, picture = iter(self), None
        upcoming = next(read, None)
        for time in times.tolist():
            while upcoming is not None and (picture is None or upcoming[0] <= time):
                picture, upcoming = upcoming[1], next(read, None)
            if picture is None:
                return None
            if film is None:
                film = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"mp4v"), rate, picture.shape[1::-1])
                if not film.isOpened():
                    return None
            film.write(picture)
        if film is None or picture is None:
            return None
        film.release()
        return int(picture.shape[0]), int(picture.shape[1])
