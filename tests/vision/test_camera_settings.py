"""What a device is asked for, how its frames are timed, and rates where nothing says one."""

from __future__ import annotations

import struct
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from wristctl.config.camera import Device
from wristctl.vision.camera import CameraError, FolderCamera, VideoCamera
from wristctl.vision.device_camera import DeviceCamera

BY_HAND = {cv2.CAP_PROP_AUTO_EXPOSURE: 1.0, cv2.CAP_PROP_AUTOFOCUS: 0.0, cv2.CAP_PROP_AUTO_WB: 0.0}
"""What switches everything off that a device would choose."""


class Capture:
    """Stands in for OpenCV's: gives one picture, and stamps it so many seconds from now."""

    def __init__(self) -> None:
        self.asked: dict[int, float] = {}
        self.deaf: dict[int, float] = {}
        self.opened: Any = None
        self.stamp, self.given, self.pictures, self.rate = 0.0, 0.0, 1, 25.0
        self.released, self.done = False, threading.Event()

    def isOpened(self) -> bool:
        return True

    def set(self, name: int, value: float) -> None:
        self.asked[name] = value

    def get(self, name: int) -> float:
        if name == cv2.CAP_PROP_POS_MSEC:
            self.given = time.monotonic() + self.stamp
            return 1e3 * self.given
        return self.deaf.get(name, self.asked.get(name, self.rate))

    def read(self) -> tuple[bool, Any]:
        if self.pictures == 0:
            self.done.wait(5.0)
            return False, None
        self.pictures -= 1
        return True, np.full((4, 6, 3), (255, 0, 0), np.uint8)  # blue

    def release(self) -> None:
        self.released = True


@pytest.fixture
def capture(monkeypatch: pytest.MonkeyPatch) -> Capture:
    made = Capture()

    def opened(place: Any) -> Capture:
        made.opened = place
        return made

    monkeypatch.setattr(cv2, "VideoCapture", opened)
    return made


def closed(camera: DeviceCamera, capture: Capture) -> None:
    capture.done.set()
    camera.close()
    assert capture.released


def test_a_device_that_takes_half_a_second_to_its_first_picture_is_waited_for(
    capture: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_once = capture.read

    def late() -> tuple[bool, Any]:
        time.sleep(0.5)
        return at_once()

    monkeypatch.setattr(capture, "read", late)
    camera = DeviceCamera("0", Device())
    assert camera.newest() is not None
    closed(camera, capture)


@pytest.mark.parametrize(("source", "place"), [("2", 2), ("/dev/video2", "/dev/video2")])
def test_a_device_is_asked_for_what_is_set_and_for_one_frame_of_buffer(
    capture: Capture, source: str, place: Any
) -> None:
    camera = DeviceCamera(source, Device(width=800, height=600, frame_rate=60.0, exposure=7.0))
    assert capture.opened == place and camera.name == source
    assert capture.asked == {
        cv2.CAP_PROP_FRAME_WIDTH: 800, cv2.CAP_PROP_FRAME_HEIGHT: 600, cv2.CAP_PROP_FPS: 60.0,
        **BY_HAND, cv2.CAP_PROP_EXPOSURE: 7.0, cv2.CAP_PROP_BUFFERSIZE: 1,
    }  # fmt: skip
    closed(camera, capture)


def test_the_format_is_asked_for_first_and_values_once_the_device_no_longer_chooses_them(capture: Capture) -> None:
    asked = Device(fourcc="MJPG", width=800, exposure=50.0, gain=3.0, focus=20.0, white_balance=4600.0)
    camera = DeviceCamera("0", asked)
    names = list(capture.asked)
    assert names[0] == cv2.CAP_PROP_FOURCC and capture.asked[cv2.CAP_PROP_FOURCC] == 0x47504A4D
    for automatic, by_hand in (
        (cv2.CAP_PROP_AUTO_EXPOSURE, cv2.CAP_PROP_EXPOSURE),
        (cv2.CAP_PROP_AUTOFOCUS, cv2.CAP_PROP_FOCUS),
        (cv2.CAP_PROP_AUTO_WB, cv2.CAP_PROP_WB_TEMPERATURE),
    ):
        assert names.index(automatic) < names.index(by_hand)
    assert [capture.asked[name] for name in (cv2.CAP_PROP_GAIN, cv2.CAP_PROP_WB_TEMPERATURE)] == [3.0, 4600.0]
    closed(camera, capture)


@pytest.mark.parametrize(
    ("setting", "name", "stays", "said"),
    [
        ({"exposure": 50.0}, cv2.CAP_PROP_EXPOSURE, 156.0, "exposure 50 (it is 156)"),
        ({"fourcc": "MJPG"}, cv2.CAP_PROP_FOURCC, float(0x56595559), "fourcc MJPG (it is YUYV)"),
        ({"width": 1280}, cv2.CAP_PROP_FRAME_WIDTH, 640.0, "width 1280 (it is 640)"),
        ({"frame_rate": 60.0}, cv2.CAP_PROP_FPS, 30.0, "frame_rate 60 (it is 30)"),
        ({"power_line": "50 Hz"}, -1, 0.0, "power_line 50 Hz (it is unknown)"),
    ],
)
def test_what_the_device_does_not_do_is_named_with_what_it_does_instead(
    capture: Capture, setting: dict[str, Any], name: int, stays: float, said: str
) -> None:
    capture.deaf[name] = stays
    with pytest.raises(CameraError) as refused:
        DeviceCamera("97", Device.model_validate(setting))
    assert refused.value.what == f"the camera refuses {said}" and "v4l2-ctl" in refused.value.fix and capture.released


def test_a_device_that_keeps_its_automatic_exposure_is_warned_of_and_a_stream_is_not(
    capture: Capture, caplog: pytest.LogCaptureFixture
) -> None:
    capture.deaf[cv2.CAP_PROP_AUTO_EXPOSURE] = 3.0
    closed(DeviceCamera("http://127.0.0.1:1/", Device()), capture)
    assert not caplog.records
    capture.pictures = 1
    capture.done.clear()
    closed(DeviceCamera("0", Device()), capture)
    assert "automatic exposure 1 (it is 3)" in caplog.text


def test_the_power_lines_frequency_goes_to_the_driver(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the numbers of linux/videodev2.h."""
    told: list[tuple[int, int, int]] = []

    def ioctl(file: Any, request: int, control: bytes) -> bytes:
        name, value = struct.unpack("Ii", control)
        told.append((request, name, value))
        return struct.pack("Ii", name, 2)

    monkeypatch.setattr("fcntl.ioctl", ioctl)
    camera = DeviceCamera("/dev/null", Device(power_line="60 Hz"))
    assert told == [(0xC008561C, 0x980918, 2), (0xC008561B, 0x980918, 0)]
    closed(camera, capture)
    with pytest.raises(CameraError, match=r"power_line 50 Hz \(it is 60 Hz\)"):
        DeviceCamera("/dev/null", Device(power_line="50 Hz"))


def test_what_is_not_set_is_left_as_it_is_but_nothing_is_automatic(capture: Capture) -> None:
    camera = DeviceCamera("0", Device())
    assert capture.asked == {**BY_HAND, cv2.CAP_PROP_BUFFERSIZE: 1}
    frame = camera.newest()
    assert frame is not None and frame.number == 0
    assert frame.image.shape == (4, 6) and frame.image[0, 0] == 29, "blue is a dark grey"
    assert camera.newest() is None, "no more has come, and none is lost yet"
    closed(camera, capture)


@pytest.mark.parametrize(
    ("stamp", "believed"), [(-0.5, True), (-0.9, True), (-1.5, False), (9.0, False), (-1e6, False)]
)
def test_the_drivers_stamp_is_believed_where_it_is_of_the_last_second(
    capture: Capture, stamp: float, believed: bool
) -> None:
    capture.stamp = stamp
    before = time.monotonic()
    camera = DeviceCamera("0", Device(delay=0.25))
    after, frame = time.monotonic(), camera.newest()
    assert frame is not None
    if believed:
        assert frame.time == pytest.approx(capture.given - 0.25)
    else:
        assert before <= frame.time + 0.25 <= after
    closed(camera, capture)


def test_a_device_without_a_picture_is_given_back(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.vision.device_camera._FIRST_FRAME", 0.05)
    capture.pictures = 0
    threading.Timer(0.2, capture.done.set).start()
    with pytest.raises(CameraError, match="gave no picture within"):
        DeviceCamera("0", Device())
    assert capture.released


@pytest.mark.parametrize(("given", "told", "rate"), [(None, 25.0, 25.0), (None, 0.0, 30.0), (10.0, 25.0, 10.0)])
def test_a_videos_rate_is_the_given_one_its_own_or_thirty(
    capture: Capture, tmp_path: Path, given: float | None, told: float, rate: float
) -> None:
    capture.rate, capture.pictures = told, 2
    capture.done.set()
    (tmp_path / "video.avi").write_bytes(b"x")
    assert VideoCamera(tmp_path / "video.avi", given).frame_rate == rate


def test_a_folders_rate_is_thirty_where_nothing_says_it(tmp_path: Path) -> None:
    for name in ("b.png", "a.JPG", "c.tiff"):
        cv2.imencode(Path(name).suffix.lower(), np.zeros((4, 6), np.uint8))[1].tofile(tmp_path / name)
    frames = list(FolderCamera(tmp_path))
    assert [frame.time for frame in frames] == pytest.approx([0.0, 1 / 30, 2 / 30])
    assert [file.name for file in FolderCamera(tmp_path).files] == ["a.JPG", "b.png", "c.tiff"]


def test_stamps_that_were_the_drivers_at_first_are_handed_on_as_they_are(capture: Capture) -> None:
    """What is wrong with them later is for the loop to see; a clock of our own in their place would hide it."""
    capture.stamp, capture.pictures = -0.01, 1
    camera = DeviceCamera("0", Device())
    first = camera.newest()
    assert first is not None and first.time == pytest.approx(capture.given)
    capture.stamp = 5.0
    assert camera._stamp() == pytest.approx(capture.given) and capture.given > time.monotonic() + 4.0
    closed(camera, capture)
