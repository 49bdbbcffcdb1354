"""Frames come in order from recordings, the newest first from devices, and what is wrong is said in a line."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from wristctl.config.camera import Device
from wristctl.vision.camera import (
    CameraError,
    FolderCamera,
    VideoCamera,
    is_device,
    open_recording,
)
from wristctl.vision.device_camera import DeviceCamera


def flat(grey: int) -> np.ndarray:
    return np.full((48, 64, 3), grey, np.uint8)


@pytest.fixture
def video(tmp_path: Path) -> Path:
    file = tmp_path / "trial.avi"
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (64, 48))
    for k in range(12):
        writer.write(flat(10 * k))
    writer.release()
    return file


def test_a_videos_frames_come_in_order_and_in_time(video: Path) -> None:
    frames = list(VideoCamera(video))
    assert [frame.number for frame in frames] == list(range(12))
    assert np.array([frame.time for frame in frames]) == pytest.approx(np.arange(12) / 50.0, abs=1e-6)
    assert [round(float(frame.image.mean()), -1) for frame in frames] == [10.0 * k for k in range(12)]
    assert frames[0].image.shape == (48, 64) and frames[0].image.dtype == np.uint8


def test_a_given_frame_rate_wins_over_the_files(video: Path) -> None:
    assert [frame.time for frame in VideoCamera(video, 100.0)][3] == pytest.approx(0.03)


def test_pictures_come_by_the_numbers_in_their_names(tmp_path: Path) -> None:
    for k in (10, 2, 1):
        cv2.imwrite(str(tmp_path / f"frame{k}.png"), flat(k))
    (tmp_path / "notes.txt").write_text("no picture")
    frames = list(FolderCamera(tmp_path, 10.0))
    assert [int(frame.image[0, 0]) for frame in frames] == [1, 2, 10]
    assert [frame.time for frame in frames] == pytest.approx([0.0, 0.1, 0.2])


def test_what_cannot_be_read_is_said_with_exit_code_4(tmp_path: Path) -> None:
    text, empty = tmp_path / "notes.mp4", tmp_path / "empty"
    text.write_text("no video")
    empty.mkdir()
    for source, said in (
        (tmp_path / "none.mp4", "no such video"),
        (text, "no video that can be decoded"),
        (empty, "no pictures in this folder"),
    ):
        with pytest.raises(CameraError, match=said) as caught:
            open_recording(str(source))
        assert caught.value.exit_code == 4 and str(source) in str(caught.value) and caught.value.fix
    (empty / "bad.png").write_bytes(b"no picture")
    with pytest.raises(CameraError, match=r"cannot be decoded - .*bad\.png"):
        list(FolderCamera(empty))


def test_a_missing_device_says_what_to_check(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(CameraError, match="no such camera") as caught:
        DeviceCamera("97", Device())
    assert caught.value.exit_code == 4 and "cable" in caught.value.fix
    assert capfd.readouterr().err == ""  # nothing of OpenCV's own beside it


def test_devices_are_told_from_files() -> None:
    assert is_device("0") and is_device("/dev/video2") and is_device("http://127.0.0.1:8080/")
    assert not is_device("trial.mp4") and not is_device("pictures")


class Webcam:
    """Stands in for a device: gives a picture whenever the test lets it."""

    def __init__(self, _source: object) -> None:
        self.asked: dict[int, float] = {}
        self.let, self.given, self.gone = threading.Semaphore(1), 0, False

    def isOpened(self) -> bool:
        return True

    def set(self, name: int, value: float) -> None:
        self.asked[name] = value

    def get(self, name: int) -> float:
        return self.asked.get(name, 0.0)

    def read(self) -> tuple[bool, Any]:
        self.let.acquire()
        self.given += 1
        return not self.gone, flat(self.given)

    def release(self) -> None:
        self.gone = True


@pytest.fixture
def webcam(monkeypatch: pytest.MonkeyPatch) -> Webcam:
    made = Webcam(None)
    monkeypatch.setattr(cv2, "VideoCapture", lambda _source: made)
    return made


def wait_for(webcam: Webcam, count: int) -> None:
    end = time.monotonic() + 5.0
    while webcam.given < count and time.monotonic() < end:
        time.sleep(0.001)
    time.sleep(0.02)  # the picture is handed over after it was read


def test_of_a_devices_frames_the_newest_wins(webcam: Webcam) -> None:
    camera = DeviceCamera("0", Device(width=1280, exposure=5.0, delay=0.25))
    assert webcam.asked[cv2.CAP_PROP_FRAME_WIDTH] == 1280 and webcam.asked[cv2.CAP_PROP_EXPOSURE] == 5.0
    for _ in range(3):
        webcam.let.release()
    wait_for(webcam, 4)
    before = time.monotonic()
    frame = camera.newest()
    assert frame is not None and (frame.number, int(frame.image[0, 0])) == (3, 4)
    assert before - 2.0 < frame.time < before - 0.25 + 0.01
    assert camera.newest() is None
    webcam.let.release()
    camera.close()


def test_a_device_that_goes_away_is_an_error_not_a_silence(webcam: Webcam) -> None:
    camera = DeviceCamera("0", Device())
    assert camera.newest() is not None
    webcam.gone = True
    webcam.let.release()
    wait_for(webcam, 2)
    with pytest.raises(CameraError, match="gives no more pictures"):
        camera.newest()
    camera.close()
