"""Camera as the loop's source of frames, and recordings as cameras: a video file, a folder of pictures."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.errors import UserError
from wristctl.plain_files import read_plain, unreadable

Image = NDArray[np.uint8]

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm")
# Frames per second where nothing says it.
_RATE = 30.0


class Frame(NamedTuple):
    """One picture."""

    image: Image
    """(height, width) grey"""
    time: float
    """Middle of the exposure [s]"""
    number: int
    """Counts the frames that the camera took; a gap is a frame that nobody saw."""


class Camera(Protocol):
    """Source of frames. Newest wins: a frame that was not asked for in time is never seen."""

    name: str

    def newest(self) -> Frame | None:
        """The newest frame since the last call, None if none has come. Never waits. Raises CameraError."""

    def close(self) -> None:
        """Give the camera back."""


class CameraError(UserError):
    """A camera or a recording that gives no pictures."""

    def __init__(self, what: str, where: str, fix: str) -> None:
        super().__init__(what, where, fix, exit_code=4)

    def of(self, camera: int) -> "CameraError":
        """The same, said of this camera of two."""
        return CameraError(f"camera {camera}: {self.what}", self.where, self.fix)


class VideoCamera:
    """The frames of a video file, one by one; `frame_rate` overrides the file's own. Raises CameraError."""

    def __init__(self, file: Path, frame_rate: float | None = None) -> None:
        self.name = str(file)
        if not file.is_file():
            raise CameraError("no such video", str(file), "check the path; a folder of pictures will do too")
        with without_warnings():
            self._capture = cv2.VideoCapture(str(file))
            got, picture = self._capture.read() if self._capture.isOpened() else (False, None)
        if not got or picture is None:
            self._capture.release()
            fix = "name a video that plays (mp4, avi, mkv), or convert it: ffmpeg -i FILE out.mp4"
            raise CameraError("this is no video that can be decoded", str(file), fix)
        rate = frame_rate or self._capture.get(cv2.CAP_PROP_FPS)
        self._stamped, self.frame_rate = frame_rate is None, rate if rate > 0.0 else _RATE
        self._next: Frame | None = Frame(grey_of(picture), 0.0, 0)

    def newest(self) -> Frame | None:
        """The next frame."""
        frame = self._next
        if frame is not None:
            got, picture = self._capture.read()
            number = frame.number + 1
            self._next = Frame(grey_of(picture), self._time(frame.time, number), number) if got else None
        return frame

    def close(self) -> None:
        """Close the file."""
        self._capture.release()

    def __iter__(self) -> Iterator[Frame]:
        return iter(self.newest, None)

    def _time(self, before: float, number: int) -> float:
        """By the file's stamps, which know of uneven frames; by the frame rate where they stand still."""
        stamp = 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)
        return stamp if self._stamped and stamp > before else number / self.frame_rate


class FolderCamera:
    """The pictures of a folder in the order of their names (numbers by value). Raises CameraError."""

    def __init__(self, folder: Path, frame_rate: float | None = None) -> None:
        self.name, self.frame_rate = str(folder), frame_rate or _RATE
        if not folder.is_dir():
            raise CameraError("no such folder", str(folder), "check the path")
        self.files = sorted((f for f in folder.iterdir() if f.suffix.lower() in PICTURES), key=_by_number)
        if not self.files:
            raise CameraError("no pictures in this folder", str(folder), f"put {', '.join(PICTURES[:3])} files there")
        self._number = 0

    def newest(self) -> Frame | None:
        """The next picture."""
        if self._number == len(self.files):
            return None
        file, number = self.files[self._number], self._number
        self._number += 1
        try:
            content = np.frombuffer(read_plain(file), np.uint8)
        except OSError as error:
            raise CameraError(unreadable(error, file).what, str(file), "put a picture in its place") from error
        picture = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
        if picture is None:
            raise CameraError("this picture cannot be decoded", str(file), "remove it from the folder, or replace it")
        return Frame(grey_of(picture), number / self.frame_rate, number)

    def close(self) -> None:
        """Nothing is open."""

    def __iter__(self) -> Iterator[Frame]:
        return iter(self.newest, None)


def open_recording(source: str, frame_rate: float | None = None) -> VideoCamera | FolderCamera:
    """A video file, or a folder of pictures. Raises CameraError."""
    path = Path(source)
    return FolderCamera(path, frame_rate) if path.is_dir() else VideoCamera(path, frame_rate)


def is_device(source: str) -> bool:
    """Whether `source` names a camera device, or a stream of one, rather than a recording."""
    return source.isdigit() or source.startswith(("/dev/", "http://", "https://", "rtsp://"))


def grey_of(picture: NDArray[Any]) -> Image:
    """The brightness of a picture with or without colours."""
    grey: NDArray[Any] = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
    return grey.astype(np.uint8, copy=False)


def _by_number(file: Path) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)]


@contextmanager
def without_warnings() -> Iterator[None]:
    """OpenCV's own warnings about what cannot be opened go: one line of ours says it."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
