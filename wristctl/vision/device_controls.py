"""What a camera device is asked for, and whether it has done so: its answer is read back."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2

from wristctl.config.vision import Device

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
