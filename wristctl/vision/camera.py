"""What a camera is to the loop, and the cameras there are: a device, a video file, a folder of pictures."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.config.errors import UserError
from wristctl.config.vision import Device

Image = NDArray[np.uint8]

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm")
_RATE = 30.0
"""Frames per second where nothing says it."""
_FIRST_FRAME = 3.0
"""Seconds that a device may take to its first frame."""


class Frame(NamedTuple):
    """One picture."""

    image: Image
    """(height, width) grey"""
    time: float
    """Middle of the exposure [s]"""
    number: int
    """Counts the frames that the camera took; a gap is a frame that nobody saw."""


class Camera(Protocol):
    """Where frames come from. Newest wins: a frame that was not asked for in time is never seen."""

    name: str

    def newest(self) -> Frame | None:
        """The newest frame since the last call, None if none has come. Never waits. Raises CameraError."""

    def close(self) -> None:
        """Give the camera back."""


class CameraError(UserError):
    """A camera or a recording that gives no pictures."""

    def __init__(self, what: str, where: str, fix: str) -> None:
        super().__init__(what, where, fix, exit_code=4)


class DeviceCamera:
    """A camera device by number or path, read by a thread of its own. Raises CameraError."""

    def __init__(self, source: str, settings: Device) -> None:
        self.name = source
        place: int | str = int(source) if source.isdigit() else source
        with _quiet():
            self._capture = cv2.VideoCapture(place)
        if not self._capture.isOpened():
            self._capture.release()
            fix = "check the cable, its number (ls /dev/video*), that no other program uses it, that you may read it"
            raise CameraError("no such camera, or it cannot be opened", source, f"{fix} (group video)")
        self._set(settings)
        self._delay = settings.delay
        self._lock, self._stop, self._came = threading.Lock(), threading.Event(), threading.Event()
        self._waiting: Frame | None = None
        self._lost = False
        self._thread = threading.Thread(target=self._read, name=f"camera {source}", daemon=True)
        self._thread.start()
        if not self._came.wait(_FIRST_FRAME):
            self.close()
            fix = "close other programs that use it, try another USB port, or ask less of it (width, frame_rate)"
            raise CameraError(f"the camera gave no picture within {_FIRST_FRAME:g} s", source, fix)

    def newest(self) -> Frame | None:
        """The newest frame since the last call. Raises CameraError once the device is gone."""
        with self._lock:
            frame, self._waiting = self._waiting, None
        if frame is None and self._lost:
            raise CameraError("the camera gives no more pictures", self.name, "plug it in again")
        return frame

    def close(self) -> None:
        """Stop the thread and release the device."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._capture.release()

    def _set(self, asked: Device) -> None:
        wanted = (
            (cv2.CAP_PROP_FRAME_WIDTH, asked.width),
            (cv2.CAP_PROP_FRAME_HEIGHT, asked.height),
            (cv2.CAP_PROP_FPS, asked.frame_rate),
            (cv2.CAP_PROP_AUTO_EXPOSURE, None if asked.exposure is None else 1),
            (cv2.CAP_PROP_EXPOSURE, asked.exposure),
            (cv2.CAP_PROP_BUFFERSIZE, 1),
        )
        for name, value in wanted:
            if value is not None:
                self._capture.set(name, value)

    def _read(self) -> None:
        number = 0
        while not self._stop.is_set():
            got, picture = self._capture.read()
            if not got:
                self._lost = True
                return
            frame = Frame(_grey(picture), self._stamp() - self._delay, number)
            number += 1
            with self._lock:
                self._waiting = frame
            self._came.set()

    def _stamp(self) -> float:
        """The driver's own stamp where it is of the monotonic clock (V4L2), else now."""
        now, stamp = time.monotonic(), 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)
        return stamp if now - 1.0 < stamp <= now else now


class VideoCamera:
    """The frames of a video file, one by one; `frame_rate` overrides the file's own. Raises CameraError."""

    def __init__(self, file: Path, frame_rate: float | None = None) -> None:
        self.name = str(file)
        if not file.is_file():
            raise CameraError("no such video", str(file), "check the path; a folder of pictures will do too")
        with _quiet():
            self._capture = cv2.VideoCapture(str(file))
            got, picture = self._capture.read() if self._capture.isOpened() else (False, None)
        if not got or picture is None:
            self._capture.release()
            fix = "name a video that plays (mp4, avi, mkv), or convert it: ffmpeg -i FILE out.mp4"
            raise CameraError("this is no video that can be decoded", str(file), fix)
        rate = frame_rate or self._capture.get(cv2.CAP_PROP_FPS)
        self._stamped, self.frame_rate = frame_rate is None, rate if rate > 0.0 else _RATE
        self._next: Frame | None = Frame(_grey(picture), 0.0, 0)

    def newest(self) -> Frame | None:
        """The next frame."""
        frame = self._next
        if frame is not None:
            got, picture = self._capture.read()
            number = frame.number + 1
            self._next = Frame(_grey(picture), self._time(frame.time, number), number) if got else None
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
        picture = cv2.imdecode(np.fromfile(file, np.uint8), cv2.IMREAD_GRAYSCALE) if file.stat().st_size else None
        if picture is None:
            raise CameraError("this picture cannot be decoded", str(file), "remove it from the folder, or replace it")
        return Frame(_grey(picture), number / self.frame_rate, number)

    def close(self) -> None:
        """Nothing is open."""

    def __iter__(self) -> Iterator[Frame]:
        return iter(self.newest, None)


def open_recording(source: str, frame_rate: float | None = None) -> VideoCamera | FolderCamera:
    """A video file, or a folder of pictures. Raises CameraError."""
    path = Path(source)
    return FolderCamera(path, frame_rate) if path.is_dir() else VideoCamera(path, frame_rate)


def is_device(source: str) -> bool:
    """Whether `source` names a camera device rather than a recording."""
    return source.isdigit() or source.startswith("/dev/")


def _grey(picture: NDArray[Any]) -> Image:
    grey: NDArray[Any] = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
    return grey.astype(np.uint8, copy=False)


def _by_number(file: Path) -> list[tuple[int, str]]:
    """frame2 before frame10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)]


@contextmanager
def _quiet() -> Iterator[None]:
    """OpenCV's own warnings about what cannot be opened go: one line of ours says it."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
