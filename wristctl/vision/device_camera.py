"""A camera that gives pictures now: a device of this computer, or a stream over the network."""

import logging
import struct
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2

from wristctl.config.camera import Device
from wristctl.loop_priority import beside_the_loop
from wristctl.processes import check_hardware_allowed
from wristctl.vision.camera import CameraError, Frame, grey_of, without_warnings

log = logging.getLogger(__name__)

_MANUAL, _PRIORITY = 1.0, 3.0
"""V4L2's exposure_auto: by hand; by aperture priority, which is the webcams' automatic one."""
_POWER_LINE, _SET, _GET = 0x00980918, 0xC008561C, 0xC008561B
"""V4L2_CID_POWER_LINE_FREQUENCY, VIDIOC_S_CTRL and VIDIOC_G_CTRL of linux/videodev2.h: OpenCV has no name for it."""
_CONTROL = struct.Struct("Ii")
_MENU = {"off": 0, "50 Hz": 1, "60 Hz": 2}


class Asked(NamedTuple):
    """One property of OpenCV's, by the setting that it comes from."""

    setting: str
    name: int
    value: float
    explicit: bool = True
    """Whether the user named it, and wants to hear that it cannot be had."""


class Refusal(NamedTuple):
    """What a device has not done."""

    said: str
    explicit: bool


class Properties(Protocol):
    """Where properties are read: cv2.VideoCapture."""

    def get(self, name: int, /) -> float:
        """The present value."""


def asked_for(device: Device) -> list[Asked]:
    """In the order in which a device must hear it: the format decides which sizes and rates there are."""
    code = None if device.fourcc is None else float(cv2.VideoWriter.fourcc(*device.fourcc))
    wanted = [
        ("fourcc", cv2.CAP_PROP_FOURCC, code),
        ("width", cv2.CAP_PROP_FRAME_WIDTH, device.width),
        ("height", cv2.CAP_PROP_FRAME_HEIGHT, device.height),
        ("frame_rate", cv2.CAP_PROP_FPS, device.frame_rate),
    ]
    found = [Asked(setting, name, float(value)) for setting, name, value in wanted if value is not None]
    by_hand = not device.automatic
    found.append(Asked("automatic exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL if by_hand else _PRIORITY, False))
    found += [
        Asked(f"automatic {what}", name, float(device.automatic), False)
        for what, name in (("focus", cv2.CAP_PROP_AUTOFOCUS), ("white balance", cv2.CAP_PROP_AUTO_WB))
    ]
    values = [
        ("exposure", cv2.CAP_PROP_EXPOSURE, device.exposure),
        ("gain", cv2.CAP_PROP_GAIN, device.gain),
        ("focus", cv2.CAP_PROP_FOCUS, device.focus),
        ("white_balance", cv2.CAP_PROP_WB_TEMPERATURE, device.white_balance),
    ]
    return found + [Asked(setting, name, float(value)) for setting, name, value in values if value is not None]


def refused(wanted: list[Asked], capture: Properties, source: str, device: Device) -> list[Refusal]:
    """What the device has not done of this, and of its power line's frequency, which is asked for here."""
    found = []
    for each in wanted:
        now = capture.get(each.name)
        if abs(now - each.value) > 0.01 * abs(each.value) + 1e-6:
            said = f"{each.setting} {_shown(each.name, each.value)} (it is {_shown(each.name, now)})"
            found.append(Refusal(said, each.explicit))
    if (lamps := device.power_line) is not None and (set_to := _power_line(source, _MENU[lamps])) != lamps:
        found.append(Refusal(f"power_line {lamps} (it is {set_to or 'unknown'})", True))
    return found


def _shown(name: int, value: float) -> str:
    if name != cv2.CAP_PROP_FOURCC:
        return f"{value:g}"
    return "".join(chr(int(value) >> shift & 0xFF) for shift in (0, 8, 16, 24)).strip("\0") or "unknown"


def _power_line(source: str, menu: int) -> str | None:
    """Set the frequency against which a V4L2 device guards from flicker, and say what it then is."""
    path = Path(f"/dev/video{source}" if source.isdigit() else source)
    with suppress(OSError, ImportError):
        from fcntl import ioctl

        with path.open("rb", buffering=0) as file:
            ioctl(file, _SET, _CONTROL.pack(_POWER_LINE, menu))
            _, now = _CONTROL.unpack(ioctl(file, _GET, _CONTROL.pack(_POWER_LINE, 0)))
        return next((name for name, number in _MENU.items() if number == now), None)
    return None


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
