"""A frame that two processes share: whole, once, and the newest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wristctl.bench.frame_process import FrameMemory
from wristctl.vision.camera import Frame


@pytest.fixture
def sides(tmp_path: Path) -> tuple[FrameMemory, FrameMemory]:
    writer = FrameMemory(tmp_path / "frame", (3, 5))
    return writer, FrameMemory(tmp_path / "frame")


def frame(number: int) -> Frame:
    return Frame(np.arange(15, dtype=np.uint8).reshape(3, 5) + np.uint8(number), 0.5 * number, number)


def test_the_newest_frame_is_seen_whole_and_once(sides: tuple[FrameMemory, FrameMemory]) -> None:
    writer, camera = sides
    assert camera.newest() is None
    writer.write(frame(1))
    writer.write(frame(2))
    seen = camera.newest()
    assert seen is not None and (seen.number, seen.time) == (2, 1.0)
    assert np.array_equal(seen.image, frame(2).image)
    assert camera.newest() is None
    writer.write(frame(3))
    assert np.array_equal(seen.image, frame(2).image), "what was seen stays as it was"
    again = camera.newest()
    assert again is not None and again.number == 3


def test_a_frame_that_is_being_written_is_not_seen(tmp_path: Path) -> None:
    writer, camera = FrameMemory(tmp_path / "frame", (3, 5)), FrameMemory(tmp_path / "frame")
    writer.write(frame(1))
    counts = np.memmap(tmp_path / "frame", np.int64, "r+", shape=(1,))
    counts += 1
    assert camera.newest() is None
    counts += 1
    assert camera.newest() is not None


def test_a_frame_that_changes_while_it_is_read_is_not_seen(
    sides: tuple[FrameMemory, FrameMemory], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, camera = sides
    writer.write(frame(1))
    made = Frame.__new__

    def slowly(kind: type[Frame], *values: object) -> Frame:
        monkeypatch.undo()
        writer.write(frame(2))
        return made(kind, *values)  # type: ignore[arg-type]

    monkeypatch.setattr(Frame, "__new__", slowly)
    assert camera.newest() is None
    seen = camera.newest()
    assert seen is not None and seen.number == 2


def test_its_name_is_its_file(tmp_path: Path) -> None:
    FrameMemory(tmp_path / "frame", (3, 5))
    assert FrameMemory(tmp_path / "frame").name == str(tmp_path / "frame")
