"""A camera that gives pictures now: a device of this computer, or a stream over the network."""

import logging
import struct
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import cv2

from wristctl.config.camera import Device
from wristctl.loop_priority import beside_the_loop
from wristctl.processes import check_hardware_allowed
from wristctl.vision.camera import CameraError, Frame, grey_of, without_warnings

log = logging.getLogger(__name__)

# V4L2's exposure_auto: by hand; by aperture priority, which is the webcams' automatic one.
_MANUAL, _PRIORITY = 1.0, 3.0
# V4L2_CID_POWER_LINE_FREQUENCY, VIDIOC_S_CTRL and VIDIOC_G_CTRL of linux/videodev2.h: OpenCV has no name for it.
_POWER_LINE, _SET, _GET = 0x00980918, 0xC008561C, 0xC008561B
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
    """Setting that a device has refused."""

    said: str
    explicit: bool


def asked_for(device: Device) -> list[Asked]:
    """In the order in which a device must hear it: the format decides which sizes and rates there are."""
    code = None if device.fourcc is None else float(cv2.VideoWriter.fourcc(*device.fourcc))
    wanted = [
        ("fourcc", cv2.CAP_PROP_FOURCC, code),
        ("width", cv2.CAP_PROP_FRAME_WIDTH, device.width),
        ("height", cv2.CAP_PROP_FRAME_HEIGHT, device.height),
        ("frame_rate", cv2.CAP_PROP_FPS, device.frame_rate),
    ]
    requests = [Asked(setting, name, float(value)) for setting, name, value in wanted if value is not None]
    by_hand = not device.automatic
    requests.append(Asked("automatic exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL if by_hand else _PRIORITY, False))
    requests += [
        Asked(f"automatic {control}", name, float(device.automatic), False)
        for control, name in (("focus", cv2.CAP_PROP_AUTOFOCUS), ("white balance", cv2.CAP_PROP_AUTO_WB))
    ]
    values = [
        ("exposure", cv2.CAP_PROP_EXPOSURE, device.exposure),
        ("gain", cv2.CAP_PROP_GAIN, device.gain),
        ("focus", cv2.CAP_PROP_FOCUS, device.focus),
        ("white_balance", cv2.CAP_PROP_WB_TEMPERATURE, device.white_balance),
    ]
    return requests + [Asked(setting, name, float(value)) for setting, name, value in values if value is not None]


def refused(wanted: list[Asked], capture: cv2.VideoCapture, source: str, device: Device) -> list[Refusal]:
    """Settings that the device has refused, its power line's frequency included, which is requested here."""
    refusals = []
    for request in wanted:
        now = capture.get(request.name)
        if abs(now - request.value) > 0.01 * abs(request.value) + 1e-6:
            report = f"{request.setting} {_shown(request.name, request.value)} (it is {_shown(request.name, now)})"
            refusals.append(Refusal(report, request.explicit))
    if (lamps := device.power_line) is not None and (set_to := _power_line(source, _MENU[lamps])) != lamps:
        refusals.append(Refusal(f"power_line {lamps} (it is {set_to or 'unknown'})", True))
    return refusals


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


# Seconds that a device may take to its first frame.
_FIRST_FRAME = 3.0
# Seconds by which the first frame's stamp may be past where it is of our clock.
_FRESH = 1.0


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
            problem = "no such camera, or it cannot be opened"
            raise CameraError(problem, source, served if "://" in source else f"{fix} (group video)")
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
        for request in wanted:
            self._capture.set(request.name, request.value)
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        refusals = refused(wanted, self._capture, self.name, settings)
        if explicit := [refusal.said for refusal in refusals if refusal.explicit]:
            fix = "leave it out, or ask for what it can do: v4l2-ctl --list-ctrls-menus --list-formats-ext"
            raise CameraError(f"the camera refuses {', '.join(explicit)}", self.name, fix)
        if refusals and "://" not in self.name:
            kept = ", ".join(refusal.said for refusal in refusals)
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
