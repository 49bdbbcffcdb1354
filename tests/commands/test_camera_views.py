"""Views of the board out of pictures or a camera: which are kept, named and counted, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import wristctl
from tests.commands.conftest import session
from wristctl.commands.calibrate import camera as camera_views
from wristctl.commands.calibrate.camera import look
from wristctl.commands.progress import watched
from wristctl.commands.session import Unattended
from wristctl.errors import UserError
from wristctl.records import start_run
from wristctl.vision import charuco, device_camera
from wristctl.vision import scene as board_shots
from wristctl.vision.camera import Frame
from wristctl.vision.charuco import BoardView


def picture(value: int) -> Any:
    return np.full((10, 200), value, np.uint8)


class Finder:
    """Sees a board at a place that goes by how bright a picture is, none in a black one."""

    def __init__(self, settings: Any) -> None:
        assert settings.columns > 0

    def find(self, image: Any, name: str) -> BoardView | None:
        value = int(image[0, 0])
        return BoardView(name, np.full((8, 2), float(value)), np.zeros((8, 2)), np.arange(8)) if value else None


class Device:
    """A camera whose frames are these values; between two of them nothing has come once."""

    values: list[int]

    def __init__(self, source: str, settings: Any) -> None:
        assert source == "0"
        self.number, self.waits = 0, False
        self.name = source

    def newest(self) -> Frame | None:
        self.waits = not self.waits
        if self.waits:
            return None
        self.number += 1
        return Frame(picture(self.values[self.number - 1]), 0.0, self.number - 1)

    def close(self) -> None:
        self.values.clear()


class Helper(Unattended):
    """Lays the board down."""

    def wait_for(self, what: str) -> None:
        assert "bending plane" in what


@pytest.fixture(autouse=True)
def eyes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(charuco, "BoardFinder", Finder)
    monkeypatch.setattr(device_camera, "DeviceCamera", Device)
    clock = iter(range(10_000))

    class Clock:
        monotonic = staticmethod(lambda: float(next(clock)))
        sleep = staticmethod(lambda seconds: None)

    monkeypatch.setattr(camera_views, "time", Clock)


def seen(source: str | None, *settings: str, run: Any = None, told: list[Any] | None = None) -> Any:
    named = () if source is None else (f"calibrate-camera.camera={source}",)
    study = wristctl.load_study(None, *named, *(f"calibrate-camera.{each}" for each in settings))
    show = watched(None if told is None else lambda *each: told.append(each))
    return look(replace(session(study, run), show=show, operator=Helper()))


def folder(tmp_path: Path, *values: int) -> str:
    made = tmp_path / "views"
    made.mkdir()
    for number, value in enumerate(values):
        cv2.imwrite(str(made / f"{number}.png"), picture(value))
    return str(made)


def test_every_picture_of_a_folder_with_a_board_is_a_view_by_its_name(tmp_path: Path) -> None:
    told: list[Any] = []
    album = seen(folder(tmp_path, 50, 0, 51, 52), told=told)
    assert [view.name for view in album.views] == ["0.png", "2.png", "3.png"] and album.pictures == 4
    assert [each[:3] for each in told] == [("views", count, 4) for count in range(5)]
    assert told[-1][3] == {"views": 3}


def test_the_last_picture_must_show_the_board_where_it_lies_in_the_plane(tmp_path: Path) -> None:
    source = folder(tmp_path, 50, 80, 0)
    with pytest.raises(UserError, match="the last picture does not show the board") as caught:
        seen(source)
    assert (caught.value.where, caught.value.exit_code) == ("2.png", 3)
    assert len(seen(source, "in_plane=false").views) == 2


def test_pictures_without_any_board_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no board in 2 pictures") as caught:
        seen(folder(tmp_path, 0, 0))
    assert caught.value.exit_code == 3 and caught.value.where.endswith("views")


def test_without_a_camera_views_are_rendered_as_many_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    def shots(scene: Any, board: Any, views: int, rng: Any) -> Any:
        assert scene.width and board.columns and isinstance(rng, np.random.Generator)
        return (Frame(picture(60 + k), 0.0, k) for k in range(views))

    monkeypatch.setattr(board_shots, "board_shots", shots)
    told: list[Any] = []
    album = seen(None, "views=9", told=told)
    assert [view.name for view in album.views] == [str(k) for k in range(9)] and told[-1][1:3] == (9, 9)


def test_a_live_camera_is_asked_until_the_album_is_full_then_for_the_plane(tmp_path: Path) -> None:
    Device.values = [20 * k for k in range(1, 9)] + [0, 0, 0, 7]
    told: list[Any] = []
    with start_run("calibrate-camera", wristctl.load_study(None), "", tmp_path) as live:
        album = seen("0", "views=8", run=live, told=told)
        kept = sorted(file.name for file in (live.path / "data" / "views").iterdir())
        assert kept == [*(f"{k:03}.png" for k in range(1, 9)), "plane.png"]
        assert np.asarray(cv2.imread(str(live.path / "data/views/002.png"), 0))[0, 0] == 40
        assert np.asarray(cv2.imread(str(live.path / "data/views/plane.png"), 0))[0, 0] == 7
    assert len(album.views) == 8 and album.last.name == "frame 11" and not Device.values, "the camera is given back"
    assert told[0][2] is None and told[-1][1] == 12


def test_a_live_board_that_is_never_laid_down_is_missed_after_a_while() -> None:
    Device.values = [20 * k for k in range(1, 9)] + [0] * 100
    with pytest.raises(UserError, match="no board in"):
        seen("0", "views=8")
    assert not Device.values
    Device.values = [20 * k for k in range(1, 9)] + [7] * 9
    assert seen("0", "views=8", "in_plane=false").pictures == 8
