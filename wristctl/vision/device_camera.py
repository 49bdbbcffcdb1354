"""A camera that gives pictures now: a device of this computer, or a stream over the network."""

from __future__ import annotations

import logging
import threading
import time

import cv2

from wristctl.config.no_hardware import check_hardware_allowed
from wristctl.config.vision import Device
from wristctl.loop_priority import beside_the_loop
from wristctl.vision.camera import CameraError, Frame, grey_of, without_warnings
from wristctl.vision.device_controls import asked_for, refused

log = logging.getLogger(__name__)

_FIRST_FRAME = 3.0
"""Seconds that a device may take to its first frame."""
_FRESH = 1.0
"""Seconds by which the first frame's stamp may be past where it is of our clock."""


class DeviceCamera:
    """A camera by number, path or address, read by a thread of its own.

    Raises CameraError, and UserError where no camera may be opened.

    Frames are timed by their driver's stamps where the first of these is of the monotonic clock (V4L2), whatever they
    say later; else by when they came.
    """

    def __init__(self, source: str, settings: Device) -> None:
        check_hardware_allowed("camera", source)
        self.name = source
        place: int | str = int(source) if source.isdigit() else source
        with without_warnings():
            self._capture = cv2.VideoCapture(place)
        if not self._capture.isOpened():
            self._capture.release()
            fix = "check the cable, its number (ls /dev/video*), that no other program uses it, that you may read it"
            served = "start what serves it: wristctl hw emulate --wrist"
            what = "no such camera, or it cannot be opened"
            raise CameraError(what, source, served if "://" in source else f"{fix} (group video)")
        try:
            self._set(settings)
        except CameraError:
            self._capture.release()
            raise
        self._delay = settings.delay
        self._lock, self._stop, self._came = threading.Lock(), threading.Event(), threading.Event()
        self._waiting: Frame | None = None
        self._lost = False
        self._stamped: bool | None = None
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

    def _set(self, settings: Device) -> None:
        """Ask the device, and see by what it then says whether it has done so. Raises CameraError."""
        wanted = asked_for(settings)
        for each in wanted:
            self._capture.set(each.name, each.value)
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        found = refused(wanted, self._capture, self.name, settings)
        if told := [each.said for each in found if each.explicit]:
            fix = "leave it out, or ask for what it can do: v4l2-ctl --list-ctrls-menus --list-formats-ext"
            raise CameraError(f"the camera refuses {', '.join(told)}", self.name, fix)
        if found and "://" not in self.name:
            kept = ", ".join(each.said for each in found)
            log.warning("%s keeps its own control: %s; light that changes will change its pictures", self.name, kept)

    def _read(self) -> None:
        beside_the_loop()
        number = 0
        while not self._stop.is_set():
            got, picture = self._capture.read()
            if not got:
                self._lost = True
                return
            frame = Frame(grey_of(picture), self._stamp() - self._delay, number)
            number += 1
            with self._lock:
                self._waiting = frame
            self._came.set()

    def _stamp(self) -> float:
        now, stamp = time.monotonic(), 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)
        if self._stamped is None:
            self._stamped = now - _FRESH < stamp <= now
        return stamp if self._stamped else now
