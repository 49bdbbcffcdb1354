"""The rendered camera stands where its settings say, and its pixels are those of a pinhole with a lens."""

from __future__ import annotations

import math
from typing import Any, Literal

import cv2
import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.camera import SceneSettings
from wristctl.vision.view import Pinhole

Side = Literal["right", "left"]
SIDES: tuple[Side, ...] = ("right", "left")


def pinhole(positive: Side = "right", **changes: Any) -> Pinhole:
    return Pinhole(SceneSettings.model_validate({"width": 640, "height": 400, "distortion": 0.0, **changes}), positive)


def place(camera: Pinhole) -> Array:
    """Where the camera stands in the world [m]."""
    return -camera.rotation.T @ camera.translation


def test_the_point_looked_at_is_in_the_middle_of_the_picture_whatever_the_pose() -> None:
    for positive in SIDES:
        camera = pinhole(positive, height_above=0.07, tilt_deg=20.0, pan_deg=-10.0, roll_deg=35.0)
        assert camera.size == (640, 400)
        assert camera.project(np.array([0.07, 0.0, 0.0])) == pytest.approx([319.5, 199.5])  # of pixels' centres


def test_half_the_field_of_view_reaches_the_pictures_edge() -> None:
    camera = pinhole(field_deg=50.0, distance=0.3, height_above=0.06)
    aside = 0.3 * math.tan(math.radians(25.0))
    left, right = camera.project(np.array([[0.06, -aside, 0.0], [0.06, aside, 0.0]]))
    assert left == pytest.approx([-0.5, 199.5]) and right == pytest.approx([639.5, 199.5])


@pytest.mark.parametrize("positive", SIDES)
def test_up_is_up_and_positive_angles_are_on_the_side_that_was_chosen(positive: Side) -> None:
    camera = pinhole(positive, distance=0.25, height_above=0.0)
    scale = camera.matrix[0, 0] / 0.25
    up, aside = camera.project(np.array([[0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])) - [319.5, 199.5]
    assert up == pytest.approx([0.0, -0.01 * scale])
    assert aside == pytest.approx([0.01 * scale * (1.0 if positive == "right" else -1.0), 0.0])


@pytest.mark.parametrize("positive", SIDES)
def test_the_camera_is_raised_by_its_tilt_and_moved_toward_positive_angles_by_its_pan(positive: Side) -> None:
    looked_at = np.array([0.05, 0.0, 0.0])
    for turned, away in (({"tilt_deg": 20.0}, [math.sin(math.radians(20.0)), 0.0]), ({"pan_deg": 15.0}, [0.0, 1.0])):
        camera = pinhole(positive, distance=0.3, height_above=0.05, **turned)
        offset = place(camera) - looked_at
        assert np.linalg.norm(offset) == pytest.approx(0.3)
        assert offset[2] < -0.28  # before the plane: depth grows away from the camera
        sideways = 0.3 * np.array(away) * (1.0 if "tilt_deg" in turned else math.sin(math.radians(15.0)))
        assert offset[:2] == pytest.approx(sideways, abs=1e-12)


def test_a_rolled_camera_turns_the_picture_clockwise() -> None:
    still, rolled = (pinhole(roll_deg=each, height_above=0.0) for each in (0.0, 30.0))
    point = np.array([0.02, 0.01, 0.0])
    before, after = (complex(*(each.project(point) - [319.5, 199.5])) for each in (still, rolled))
    assert after / before == pytest.approx(complex(math.cos(math.pi / 6), math.sin(math.pi / 6)))


@pytest.mark.parametrize("positive", SIDES)
def test_pixels_are_those_that_opencv_projects_with_the_same_lens(positive: Side) -> None:
    camera = pinhole(positive, distortion=-0.2, tilt_deg=10.0, pan_deg=5.0, roll_deg=-20.0)
    points = np.random.default_rng(0).uniform(-0.08, 0.12, (30, 3)) * [1.0, 1.0, 0.3]
    seen, nothing = points @ camera.rotation.T + camera.translation, np.zeros(3)
    expected = cv2.projectPoints(seen, nothing, nothing, camera.matrix, camera.distortion)[0].reshape(-1, 2)
    assert camera.project(points) == pytest.approx(expected, abs=1e-6)
    assert camera.distortion == pytest.approx([-0.2, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("distortion", [0.0, -0.1])
@pytest.mark.parametrize("positive", SIDES)
def test_its_own_view_gives_metres_to_the_right_and_down_as_the_picture_shows_them(
    positive: Side, distortion: float
) -> None:
    camera = pinhole(positive, distortion=distortion, tilt_deg=12.0, pan_deg=-6.0)
    points = np.random.default_rng(1).uniform(-0.05, 0.1, (20, 3)) * [1.0, 1.0, 0.0]
    right = points[:, 1] * (1.0 if positive == "right" else -1.0)
    found = camera.view.rectify(camera.project(points))
    assert found == pytest.approx(np.column_stack([right, -points[:, 0]]), abs=1e-7)
    assert camera.view.size == (640, 400)


@pytest.mark.parametrize("fine", [1, 3])
def test_rays_go_through_evenly_spaced_points_of_each_pixel(fine: int) -> None:
    camera = pinhole(width=200, height=140, distortion=-0.1, tilt_deg=8.0)
    rays = camera.rays(fine)
    assert rays.shape == (140 * fine, 200 * fine, 2)
    ahead = np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=2)
    pixels = camera.project((0.3 * ahead - camera.translation) @ camera.rotation)
    rows, columns = np.mgrid[: 140 * fine, : 200 * fine]
    expected = np.stack([(columns + 0.5) / fine - 0.5, (rows + 0.5) / fine - 0.5], axis=2)
    assert np.abs(pixels - expected).max() < 1e-3
    if fine == 1:
        assert expected[3, 5] == pytest.approx([5.0, 3.0])
