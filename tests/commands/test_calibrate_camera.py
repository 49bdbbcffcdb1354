"""A camera's calibration as it is told: the lens beside what views were rendered with, corners, coverage, the plane."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, session
from wristctl.commands.calibrate import camera as calibrate_camera
from wristctl.commands.calibrate.camera import CALIBRATE_CAMERA, CameraCalibrated
from wristctl.commands.inputs import Inputs
from wristctl.records import Run, start_run
from wristctl.vision import charuco
from wristctl.vision.charuco import BoardView, CameraCalibration
from wristctl.vision.view import View

MATRIX = np.array([[900.0, 0.0, 320.0], [0.0, 880.0, 240.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([0.01, -0.02, 0.003, -0.004])
TILT = 0.1
TILTS = np.radians([5.0, 25.0])
LENS = ["fx [px]", "fy [px]", "cx [px]", "cy [px]", "k1", "k2", "p1", "p2"]
Calibrate = Callable[..., CameraCalibrated]


def view(name: str, first: int, count: int) -> BoardView:
    """Corners from number `first` on, of a board seen at 1 px a mm."""
    places = np.array([[0.03 * (k % 2), 0.03 * (k // 2)] for k in range(count)])
    return BoardView(name, 300.0 + 1e3 * places + first, places, np.arange(first, first + count))


class Album:
    """Two views; the last one, which lies in the plane, has four corners."""

    views = (view("a.png", 0, 6), view("b.png", 10, 4))
    last = views[1]
    last_picture = np.full((480, 640), 90, np.uint8)
    pictures = 5
    size: tuple[int, int] | None = (640, 480)


@pytest.fixture
def calibrate(monkeypatch: pytest.MonkeyPatch) -> Calibrate:
    """A calibration that came out like this, from these views."""
    plane = np.diag([1e-3, 1e-3, 1.0])

    def found(views: Any, lying: Any, size: Any, settings: Any) -> CameraCalibration:
        assert [each.name for each in views] == ["a.png", "b.png"]
        assert size == (Album.size or (1, 1)) and (lying is None) == (not settings.in_plane)
        residuals = [np.full((6, 2), [0.5, -0.25]), np.full((4, 2), [1.5, 2.5])]
        seen = View(MATRIX, DISTORTION, plane, (640, 480))
        return CameraCalibration(
            seen, 0.4, np.array([0.3, 0.5]), residuals, np.arange(1.0, 9.0), TILTS, 0.75, 2e-4 if lying else math.nan
        )

    def calibrated(*settings: str, run: Any = None) -> Any:
        study = wristctl.load_study(None, *(f"calibrate-camera.{each}" for each in settings))
        return CALIBRATE_CAMERA.perform(session(study, run))

    monkeypatch.setattr(calibrate_camera, "look", lambda _session: Album)
    monkeypatch.setattr(charuco, "calibrate", found)
    monkeypatch.setattr(charuco, "plane_tilt", lambda seen: TILT)
    return calibrated


def test_each_number_has_its_unit_direction_and_how_many_it_is_of(calibrate: Calibrate) -> None:
    done = calibrate()
    expected = {"reprojection": 0.4, "coverage": 0.75, "tilt": math.degrees(TILT), "plane_error": 200.0}
    assert done.metrics == pytest.approx(expected)
    assert known_of(done.findings, *expected) == [
        ("px", "lower", 2), ("", "higher", 1), ("deg", "", 1), ("um", "lower", 4),
    ]  # fmt: skip
    views, _ = done.tables
    assert views.title == "Views" and views.columns == ("what", "value")
    assert [name for name, _ in views.rows] == [
        "views", "pictures", "reprojection error [px]", "coverage", "largest tilt of a view [deg]",
        "tilt of the camera to the bending plane [deg]",
    ]  # fmt: skip
    assert [value for _, value in views.rows] == pytest.approx([2, 5, 0.4, 0.75, 25.0, math.degrees(TILT)])
    assert list(done.figures) == ["reprojection", "lens", "plane"]
    assert cv2.getNumThreads() == 1


def test_the_lens_stands_beside_what_views_were_rendered_with(calibrate: Calibrate) -> None:
    _, lens = calibrate("scene={width: 800, height: 500, field_deg: 60.0, distortion: -0.1}").tables
    assert lens.columns == ("lens", "value", "standard deviation", "rendered with")
    names, values, deviations, true = zip(*lens.rows, strict=True)
    assert list(names) == LENS
    assert values == pytest.approx((900.0, 880.0, 320.0, 240.0, *DISTORTION))
    assert deviations == pytest.approx(range(1, 9))
    focal = 400.0 * math.sqrt(3.0)  # half the width over the tangent of half the field
    assert true == pytest.approx((focal, focal, 399.5, 249.5, -0.1, 0.0, 0.0, 0.0))


def test_of_a_real_camera_the_true_lens_is_not_known(calibrate: Calibrate) -> None:
    _, lens = calibrate("camera=pictures").tables
    assert lens.columns == ("lens", "value", "standard deviation")
    assert [row[0] for row in lens.rows] == LENS and {len(row) for row in lens.rows} == {3}


def test_without_a_view_in_the_bending_plane_nothing_is_said_of_it(calibrate: Calibrate) -> None:
    done = calibrate("in_plane=false")
    assert set(done.metrics) == {"reprojection", "coverage"} and list(done.figures) == ["reprojection", "lens"]
    assert "tilt of the camera to the bending plane [deg]" not in [row[0] for row in done.tables[0].rows]


def test_of_a_picture_that_was_not_kept_the_plane_is_not_drawn(
    calibrate: Calibrate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Album, "last_picture", None)
    monkeypatch.setattr(Album, "size", None)
    assert list(calibrate().figures) == ["reprojection", "lens"]


def test_a_row_of_the_table_is_a_corner_in_a_view(calibrate: Calibrate) -> None:
    table = calibrate().frame()
    assert list(table.columns) == ["view", "corner", "x", "y", "off_x", "off_y"]
    assert list(table["view"]) == ["a.png"] * 6 + ["b.png"] * 4
    assert list(table["corner"]) == [0, 1, 2, 3, 4, 5, 10, 11, 12, 13]
    np.testing.assert_allclose(table.loc[3, "x":"off_y"].astype(float), [330.0, 330.0, 0.5, -0.25])
    np.testing.assert_allclose(table.loc[8, "x":"off_y"].astype(float), [310.0, 340.0, 1.5, 2.5])


def test_a_run_keeps_the_view_with_how_sure_it_is(calibrate: Calibrate, tmp_path: Path) -> None:
    with start_run("calibrate-camera", wristctl.load_study(None), "", tmp_path) as live:
        calibrate(run=live)
    run = Run(live.path)
    np.testing.assert_allclose(View.of(run).camera_matrix, MATRIX)
    kept = json.loads(run.file("data/camera.json").read_text())
    assert kept["deviation"] == dict(zip(("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"), range(1, 9), strict=True))
    assert [kept[name] for name in ("reprojection_px", "views", "coverage", "in_plane")] == [0.4, 2, 0.75, True]
    columns = columns_of(run, "data/corners.csv")
    assert columns["x"] == ("px", "where it was seen, from the left") and columns["corner"][0] == ""
    assert columns["off_y"] == ("px", "seen less expected")
    assert len(run.data("corners")) == 10


def test_a_plan_says_where_views_come_from(calibrate: Calibrate) -> None:
    def plan(*settings: str) -> str:
        study = wristctl.load_study(None, "calibrate-camera.board={columns: 9, rows: 6}", *settings)
        return CALIBRATE_CAMERA.plan(study, Inputs())

    last = "; the last view is the board in the bending plane"
    assert plan() == f"views of a 9 x 6 board from rendered pictures (no camera is named){last}"
    camera = "calibrate-camera.camera=film.mp4"
    assert plan(camera, "calibrate-camera.in_plane=false") == "views of a 9 x 6 board from film.mp4"
