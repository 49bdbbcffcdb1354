"""Rendered pictures depend on seed and settings alone, and show what a camera there would see."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from tests.vision.conftest import bent
from wristctl.config.camera import Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision import scene as scene_module
from wristctl.vision.camera import Image
from wristctl.vision.scene import Scene
from wristctl.vision.scene_parts import FACE, THICK, Stroke
from wristctl.vision.view import Pinhole
from wristctl.wrist.kinematics import arcs_backbone, discs

WRIST = WristParameters()
QUIET = SceneSettings(noise=0.0)


def seeded() -> np.random.Generator:
    return np.random.default_rng(3)


def test_same_seed_gives_the_same_bytes_and_another_seed_does_not(scene: Scene) -> None:
    first, again = (Scene(SceneSettings(), WRIST).render(bent(20.0), seeded()) for _ in range(2))
    assert first.tobytes() == again.tobytes()
    assert first.shape == (480, 640) and first.dtype == np.uint8
    assert first.tobytes() != scene.render(bent(20.0), np.random.default_rng(4)).tobytes()


def test_noise_has_the_wanted_deviation(scene: Scene) -> None:
    clean = Scene(QUIET, WRIST).render(bent(0.0), seeded()).astype(float)
    noise = (scene.render(bent(0.0), seeded()) - clean)[(clean > 30) & (clean < 225)]
    assert noise.std() == pytest.approx(4.0, rel=0.02)
    assert abs(noise.mean()) < 0.05


def test_an_exposure_is_the_mean_of_its_instants() -> None:
    unblurred = Scene(QUIET.model_copy(update={"blur": 0.0}), WRIST)
    instants = [bent(each) for each in (0.0, 4.0, 8.0)]
    apart = [unblurred.render(each, seeded()).astype(float) for each in instants]
    together = unblurred.render(np.concatenate(instants), seeded())
    assert np.abs(together - np.mean(apart, axis=0)).max() <= 1.0  # rounding


def test_light_falls_off_across_the_picture_by_the_gradient() -> None:
    bright, flat = (
        Scene(QUIET.model_copy(update={"gradient": each}), WRIST).render(bent(0.0), seeded()).astype(float)
        for each in (0.5, 0.0)
    )
    ratio = bright / np.maximum(flat, 1.0)
    assert ratio[5, 5] - ratio[-5, -5] == pytest.approx(0.5 * 1.4, abs=0.03)


@pytest.mark.parametrize("positive", ["right", "left"])
def test_positive_angles_bend_toward_the_side_that_the_markers_settings_say(positive: str) -> None:
    scene = Scene(QUIET, WRIST, Markers(positive=positive))  # type: ignore[arg-type]
    tips = [discs(arcs_backbone, bent(each)[0], WRIST)[0][-1] for each in (0.0, 30.0)]
    straight, bent_over = scene.camera.project(np.array([[tip.real, tip.imag, 0.0] for tip in tips]))
    assert (bent_over[0] > straight[0] + 20.0) == (positive == "right")
    assert bent_over[1] > straight[1]  # and lower


@pytest.mark.parametrize("pose", [{}, {"tilt_deg": 20.0, "pan_deg": -10.0, "roll_deg": 30.0}], ids=["square", "askew"])
def test_its_view_sets_the_bending_plane_square(pose: dict[str, float]) -> None:
    settings = SceneSettings.model_validate(pose)
    scene = Scene(settings, WRIST)
    rng = np.random.default_rng(0)
    x, y = rng.uniform((0.0, -0.05), (0.12, 0.05), (50, 2)).T
    for depth in (0.0, -settings.marker_offset):
        rectified = scene.view.rectify(scene.camera.project(np.column_stack([x, y, np.full(50, depth)])))
        shape = np.column_stack([y, -x])
        scale = np.linalg.norm(rectified[1:] - rectified[0], axis=1) / np.linalg.norm(shape[1:] - shape[0], axis=1)
        assert scale == pytest.approx(scale[0], rel=1e-6)  # a similarity, of the plane itself and of parallel ones
        if depth == 0.0:
            assert rectified == pytest.approx(shape, abs=1e-7)


@pytest.mark.parametrize("above", [True, False])
def test_only_a_camera_above_sees_the_upper_face_of_a_disc(above: bool) -> None:
    tilt = 25.0 if above else -25.0
    scene = Scene(QUIET.model_copy(update={"tilt_deg": tilt, "gradient": 0.0, "blur": 0.0}), WRIST)
    picture = scene.render(bent(0.0), seeded())
    upper = np.array([[0.5 * WRIST.length + 0.5 * THICK, 0.008, 0.005]])  # of the middle disc, beside the backbone
    x, y = np.rint(scene.camera.project(upper)[0]).astype(int)
    assert (picture[y, x] == FACE) == above


def test_a_board_in_somebodys_hands_goes_over_the_whole_picture() -> None:
    """Its middle is everywhere within the picture, across as much as up and down, and not along one line."""
    camera, extent, rng = Pinhole(QUIET, "right"), np.array([0.1, 0.07]), seeded()
    seen = []
    for number in range(24):
        _, place = scene_module._held(camera, number, 25, extent, rng)
        pixel = camera.matrix @ place
        seen.append(pixel[:2] / pixel[2] / np.array(camera.size))
    middles = np.array(seen)
    assert ((middles > 0.1) & (middles < 0.9)).all() and (np.ptp(middles, axis=0) > 0.55).all()
    assert abs(np.corrcoef(middles.T)[0, 1]) < 0.2


SQUARE = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])


def drawn(
    how: Literal["line", "fill", "hull", "face"], pixels: np.ndarray, positive: Literal["left", "right"]
) -> Image:
    """A stroke of grey 200 on a wall of grey 122."""
    image: Image = np.full((60, 60), 122, np.uint8)
    scene = Scene(QUIET, WRIST, Markers(positive=positive))
    scene._draw(image, [(Stroke(np.zeros((len(pixels), 3)), 200, how), pixels)])
    return image


def test_a_hull_is_filled_and_has_a_dark_edge_all_around_whatever_the_order_of_its_points() -> None:
    for order in ([0, 1, 2, 3, 4], [2, 4, 0, 3, 1]):
        image = drawn("hull", np.concatenate([SQUARE, [[27.0, 31.0]]])[order], "right")
        assert image[30, 30] == 200 == image[25, 35] and image[30, 50] == 122 == image[10, 30]
        sides = [image[20, 30], image[40, 30], image[30, 20], image[30, 40]]
        assert max(sides) < 80, "darker than the wall and the hull"
    line = drawn("line", SQUARE, "right")
    assert line[30, 40] > 180 and line[30, 30] == 122 == line[30, 20], "open: from the last point none goes back"


def test_a_face_is_seen_from_its_front_alone() -> None:
    for positive, front in (("right", SQUARE), ("left", SQUARE[::-1])):
        assert drawn("face", front, positive)[30, 30] == 200  # type: ignore[arg-type]
        assert (drawn("face", front[::-1], positive) == 122).all()  # type: ignore[arg-type]
