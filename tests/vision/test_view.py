"""A view takes pixels to the bending plane, and back out of the file that it was saved in."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError
from pathlib import Path

import cv2
import numpy as np
import pytest

from wristctl.errors import UserError
from wristctl.vision.view import SCHEMA, View

LENS = np.array([[500.0, 0.0, 310.0], [0.0, 520.0, 250.0], [0.0, 0.0, 1.0]])
POINTS = np.array([[10.0, 20.0], [300.0, 240.0], [620.0, 30.0]])


def test_a_homography_is_applied_and_divided_by_its_third_row() -> None:
    view = View(plane=np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [0.1, 0.0, 1.0]]))
    assert view.rectify(np.array([[10.0, 20.0], [0.0, 1.0]])) == pytest.approx(np.array([[26.5, 12.0], [5.0, 5.0]]))


def test_the_view_without_a_calibration_leaves_pixels_as_they_are() -> None:
    assert np.array_equal(View().rectify(POINTS), POINTS) and np.array_equal(View.of(None).rectify(POINTS), POINTS)


@pytest.mark.parametrize(
    "distortion", [(-0.1, 0.0, 0.0, 0.0), (0.0, 0.0, 2e-3, 0.0), (-0.1, 0.02, 1e-3, -2e-3)], ids=str
)
def test_undistorted_pixels_are_those_of_a_lens_without_distortion(distortion: tuple[float, ...]) -> None:
    """Each term by itself counts, in OpenCV's order."""
    rays = np.array([[-0.3, 0.2, 1.0], [0.0, 0.0, 1.0], [0.4, -0.35, 1.0], [0.1, 0.3, 1.0]])
    seen = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), LENS, np.array(distortion))[0]
    bent = np.asarray(seen, np.float64).reshape(-1, 2)
    straight = (rays @ LENS.T)[:, :2]
    view = View(LENS, np.array(distortion))
    assert view.undistort(bent) == pytest.approx(straight, abs=0.02)
    assert view.rectify(bent) == pytest.approx(straight, abs=0.02)


def test_a_view_holds_for_pictures_of_its_size_alone() -> None:
    view = View(size=(640, 480))
    view.check_size(640, 480, "camera")
    View().check_size(1, 2, "camera")
    for size in ((480, 640), (640, 481), (641, 480)):
        with pytest.raises(
            UserError, match=f"pictures of {size[0]} x {size[1]}, but the calibration is of 640 x 480"
        ) as told:
            view.check_size(*size, "camera")
        assert told.value.exit_code == 4 and "camera" in str(told.value)


def test_a_saved_view_keeps_each_of_its_parts(tmp_path: Path) -> None:
    view = View(LENS, np.array([0.1, 0.2, 0.3, 0.4]), np.arange(9.0).reshape(3, 3), (640, 480))
    view.save(tmp_path / "camera.json", coverage=0.7)
    again = View.load(tmp_path / "camera.json")
    for name in ("camera_matrix", "distortion", "plane"):
        assert np.array_equal(getattr(again, name), getattr(view, name))
    assert again.size == (640, 480)
    written = json.loads((tmp_path / "camera.json").read_text())
    assert written["schema"] == SCHEMA and written["coverage"] == 0.7


def test_a_file_of_another_schema_is_no_calibration(tmp_path: Path) -> None:
    file = tmp_path / "camera.json"
    View(LENS, size=(640, 480)).save(file)
    file.write_text(file.read_text().replace(SCHEMA, "wristctl.camera/99"))
    with pytest.raises(UserError, match="not a camera calibration"):
        View.load(file)


def test_a_view_cannot_be_changed_once_it_is_made() -> None:
    with pytest.raises(FrozenInstanceError):
        View().size = (1, 1)  # type: ignore[misc]
