"""Recordings: the camera's own pictures as a video, annotated frames, and how good their angles are."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.vision.camera import Frame, Image
from wristctl.vision.detector import askew
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.view import View

# Columns of the table beside a video, one row a frame: unit and meaning.
COLUMNS = {
    "number": ("", "of the frame, as the camera counts"),
    "clock": ("s", "when it was taken: the middle of its exposure, on the run's one clock"),
}


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


class RawVideo(Video):
    """`file` with the pictures as they came, and a table of the same name with their times."""

    def __init__(self, file: Path, frame_rate: float) -> None:
        super().__init__(file, frame_rate)
        self._table = file.with_suffix(".csv").open("w", encoding="utf-8", buffering=1)
        self._table.write(",".join(COLUMNS) + "\n")

    def add(self, frame: Frame, sighting: Sighting) -> None:
        """The next frame, whatever was seen in it."""
        picture: Any = cv2.cvtColor(frame.image, cv2.COLOR_GRAY2BGR)
        self.write(picture)
        self._table.write(f"{frame.number},{frame.time!r}\n")

    def close(self) -> None:
        """Finish both files."""
        super().close()
        self._table.close()


def times_beside(video: Path, frames: int) -> Array | None:
    """When the frames of a video were taken (frames,) [s], by the table that `RawVideo` writes beside it.

    None without one, or where it is of another number of frames.
    """
    table = video.with_suffix(".csv")
    if video.is_dir() or not table.is_file():
        return None
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    if head.split(",") != list(COLUMNS) or len(lines) != frames:
        return None
    return np.array([float(line.rpartition(",")[2]) for line in lines])


_SPREAD, _REFUSED = 6, 3
# Okabe and Ito's blue, green and vermillion, as OpenCV orders colours.
_BASE, _TIP, _BAD, _PAPER = (178, 114, 0), (115, 158, 0), (0, 94, 213), (255, 255, 255)


def annotate(image: Image, sighting: Sighting) -> NDArray[np.uint8]:
    """A colour picture (height, width, 3, blue first): the markers' corners, the angle or why there is none."""
    picture: Any = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    usable = sighting.verdict is SightingVerdict.OK
    for corners, colour in zip(sighting.corners, (_BASE, _TIP if usable else _BAD), strict=True):
        if np.isfinite(corners).all():
            cv2.polylines(picture, [np.rint(8 * corners).astype(np.int32)], True, colour, 2, cv2.LINE_AA, 3)
            cv2.circle(picture, np.rint(corners[0]).astype(int).tolist(), 4, colour, -1, cv2.LINE_AA)
    label = f"{math.degrees(sighting.theta):+.2f} deg" if usable else str(sighting.verdict)
    text = f"{sighting.time:.3f} s   {label}"
    size = max(0.4, image.shape[1] / 1100)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    pad = height // 2
    cv2.rectangle(picture, (0, 0), (width + 2 * pad, height + below + 2 * pad), _PAPER, -1)
    place = (pad, height + pad)
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, (0, 0, 0) if usable else _BAD, 1, cv2.LINE_AA)
    return np.asarray(picture, np.uint8)


class Picked:
    """Six frames or so of a recording of any length: evenly spread, and the first of each kind that cannot be used."""

    def __init__(self) -> None:
        self._spread: list[tuple[int, NDArray[np.uint8]]] = []
        self._refused: dict[SightingVerdict, tuple[int, NDArray[np.uint8]]] = {}
        self._seen, self._every = 0, 1

    def offer(self, frame: Frame, sighting: Sighting) -> None:
        """Keep it if it is one of them."""
        number, self._seen = self._seen, self._seen + 1
        if number % self._every == 0:
            self._spread.append((number, annotate(frame.image, sighting)))
            if len(self._spread) > _SPREAD:
                self._spread, self._every = self._spread[::2], 2 * self._every
        if sighting.verdict is not SightingVerdict.OK and sighting.verdict not in self._refused:
            self._refused[sighting.verdict] = number, annotate(frame.image, sighting)

    def pictures(self) -> list[NDArray[np.uint8]]:
        """In the order of the recording."""
        pictures = dict(self._spread) | dict(list(self._refused.values())[:_REFUSED])
        return [pictures[number] for number in sorted(pictures)]


class AnnotatedVideo(Video):
    """An annotated video."""

    def add(self, frame: Frame, sighting: Sighting) -> None:
        """The next frame, annotated."""
        self.write(annotate(frame.image, sighting))


def angle_noise(angles: Array) -> float:
    """Standard deviation of one angle of a sequence (F,), in its unit; nan where no three in a row are finite.

    From second differences, in which a steady motion is nothing: of independent errors of one variance they have six
    times that variance (1 + 4 + 1).
    """
    jerks = np.diff(angles, 2)
    finite = jerks[np.isfinite(jerks)]
    return float(np.sqrt(np.mean(finite**2) / 6.0)) if len(finite) else math.nan


def base_askew(view: View, sightings: Sequence[Sighting]) -> float:
    """Systematic error of an angle [rad], from the mean shape of the base's marker in the calibrated view.

    Of the sightings with an angle, of which there must be one.
    """
    corners = np.array([sighting.corners[0] for sighting in sightings if math.isfinite(sighting.theta)])
    return askew(view.rectify(np.nanmean(corners, axis=0)))
