"""What priority changes, it changes back; what is not allowed is said, and no reason to stop."""

from __future__ import annotations

import gc
import os
import resource
import sys
import threading
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from wristctl import loop_priority
from wristctl.bench.frame_process import start_film
from wristctl.config.bench import BenchSettings, RenderedCamera
from wristctl.config.camera import Device, Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.loop_priority import BESIDE, PRIORITY, prioritised
from wristctl.trial.tracking import ThreadedTracking
from wristctl.vision.device_camera import DeviceCamera
from wristctl.vision.marker import Tracker
from wristctl.vision.view import View

ORDINARY = (os.SCHED_OTHER, 0)


def scheduled() -> tuple[int, int]:
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority


def may_come_first() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@pytest.fixture
def unlocked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Memory is not really locked: the tests' would not fit."""
    called: list[str] = []

    class Library:
        def mlockall(self, flags: int) -> int:
            called.append(f"lock {flags}")
            return 0

        def munlockall(self) -> int:
            called.append("unlock")
            return 0

    monkeypatch.setattr(loop_priority, "_libc", Library)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    return called


@pytest.mark.skipif(not may_come_first(), reason="needs the right to real-time scheduling")
@pytest.mark.slow
def test_the_loop_and_its_threads_come_first_until_the_end(unlocked: list[str]) -> None:
    before, found = scheduled(), []
    with pytest.raises(ValueError, match="ends it"), prioritised(True) as said:
        thread = threading.Thread(target=lambda: found.append(scheduled()))
        thread.start()
        thread.join()
        assert scheduled() == found[0] == (os.SCHED_FIFO, PRIORITY)
        assert not gc.isenabled() and gc.get_freeze_count() > 0 and sys.getswitchinterval() < 1e-3
        assert said == f"priority: garbage collection off, SCHED_FIFO {PRIORITY}, locked memory"
        raise ValueError("what ends it")
    assert scheduled() == before and gc.isenabled() and gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == pytest.approx(5e-3) and unlocked == ["lock 3", "unlock"]


class Observed:
    """A camera, and the device behind one, that notes who asks for its pictures."""

    name = "observed"

    def __init__(self) -> None:
        self.asked: list[tuple[int, int]] = []
        self.done = threading.Event()

    def newest(self) -> None:
        self.asked.append(scheduled())
        self.done.set()

    def read(self) -> tuple[bool, Any]:
        self.newest()
        return len(self.asked) == 1, np.zeros((4, 6, 3), np.uint8)

    def get(self, name: int) -> float:
        return 0.0

    def set(self, name: int, value: float) -> None:
        """Asked for what is refused."""

    def isOpened(self) -> bool:
        return True

    def release(self) -> None:
        """Nothing is open."""

    close = release


@pytest.mark.skipif(not may_come_first(), reason="needs the right to real-time scheduling")
@pytest.mark.parametrize(("wanted", "has"), [(True, (os.SCHED_FIFO, BESIDE)), (False, ORDINARY)])
@pytest.mark.slow
def test_whoever_sees_to_the_pictures_comes_behind_the_loop_and_before_the_rest(
    unlocked: list[str], monkeypatch: pytest.MonkeyPatch, wanted: bool, has: tuple[int, int]
) -> None:
    camera, device = Observed(), Observed()
    monkeypatch.setattr(cv2, "VideoCapture", lambda place: device)
    with prioritised(wanted):
        eye = ThreadedTracking(camera, Tracker(Markers(), View(), Gates()))
        reader = DeviceCamera("0", Device())
        assert camera.done.wait(30.0) and device.done.wait(30.0)
        eye.close()
        reader.close()
    assert {*camera.asked, *device.asked} == {has} and 0 < BESIDE < PRIORITY


@pytest.mark.skipif(not may_come_first(), reason="needs the right to real-time scheduling")
@pytest.mark.slow
def test_who_draws_the_emulated_cameras_pictures_is_as_any_program(unlocked: list[str], tmp_path: Path) -> None:
    small = BenchSettings(camera=RenderedCamera(scene=SceneSettings(width=160, height=120)))
    with prioritised(True):
        process, film = start_film(small, WristParameters(), None, tmp_path / "frame")
        assert film.recv() is None
        assert os.sched_getscheduler(process.pid or -1) == os.SCHED_OTHER
        film.close()
        process.join(30.0)
    assert process.exitcode == 0


@pytest.mark.slow
def test_what_is_not_allowed_is_said_with_where_to_read_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (65536, 65536))
    with prioritised(True) as said:
        assert not gc.isenabled()
    assert "not allowed: SCHED_FIFO 20, locked memory" in said and "documentation: Real time" in said


@pytest.mark.slow
def test_without_the_wish_nothing_changes() -> None:
    before = scheduled()
    with prioritised(False) as said:
        assert scheduled() == before and gc.isenabled() and said == ""
