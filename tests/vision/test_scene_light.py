"""What a picture is made of: prints of their contrast where they should be, light, blur and noise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.vision.conftest import bent
from wristctl.config.camera import Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.detector import Detector
from wristctl.vision.scene import Film, Scene
from wristctl.vision.scene_parts import BASE_AT
from wristctl.wrist.kinematics import arcs_backbone, discs

WRIST = WristParameters()
PLAIN = SceneSettings(noise=0.0, blur=0.0, gradient=0.0)


def corners(scene: Scene, at: complex, along: complex, side: float) -> np.ndarray:
    """Pixels of the black square of a marker here, from the upper left with its top edge toward `along`."""
    right = along * 1j * scene.camera.side
    places = at + 0.5 * side * np.array([along - right, along + right, -along + right, -along - right])
    depth = np.full(4, -SceneSettings().marker_offset)
    return np.asarray(scene.camera.project(np.column_stack([places.real, places.imag, depth])))


@pytest.mark.parametrize("positive", ["right", "left"])
@pytest.mark.parametrize("degrees", [0.0, 25.0, -25.0])
def test_both_markers_are_where_base_and_tip_are_with_their_sizes(positive: str, degrees: float) -> None:
    markers = Markers(positive=positive, base=5, tip=9, side=0.018)  # type: ignore[arg-type]
    scene = Scene(PLAIN.model_copy(update={"distortion": 0.0}), WRIST, markers)
    found = Detector().everywhere(scene.render(bent(degrees), np.random.default_rng(0)))
    assert set(found) == {5, 9}
    middles, tangents = discs(arcs_backbone, bent(degrees)[0], WRIST)
    assert found[5][0] == pytest.approx(corners(scene, complex(BASE_AT), 1.0, 0.018), abs=0.15)
    assert found[9][0] == pytest.approx(corners(scene, middles[-1], tangents[-1], 0.018), abs=0.15)


def test_swapped_markers_have_changed_places_and_a_covered_tip_is_hidden() -> None:
    scene, rng = Scene(PLAIN, WRIST), np.random.default_rng(0)
    usual, swapped = (Detector().everywhere(scene.render(bent(0.0), rng, swapped=each)) for each in (False, True))
    assert usual[0][0] == pytest.approx(swapped[1][0], abs=0.2) and usual[1][0] == pytest.approx(swapped[0][0], abs=0.2)
    covered = Detector().everywhere(scene.render(bent(0.0), rng, covered=True))
    assert set(covered) == {0} and covered[0][0] == pytest.approx(usual[0][0], abs=0.05)


@pytest.mark.parametrize("contrast", [0.4, 1.0])
def test_ink_and_paper_are_as_far_from_grey_as_the_contrast_says(contrast: float) -> None:
    scene = Scene(PLAIN.model_copy(update={"contrast": contrast}), WRIST)
    picture = scene.render(bent(0.0), np.random.default_rng(0))
    at = Detector().everywhere(Scene(PLAIN, WRIST).render(bent(0.0), np.random.default_rng(0)))[0][0]
    inside = at[0] + (at[2] - at[0]) / 12.0  # the middle of the black border's corner cell
    outside = at[0] - (at[2] - at[0]) / 12.0
    assert picture[round(inside[1]), round(inside[0])] == round(128 - 128 * contrast)
    assert picture[round(outside[1]), round(outside[0])] == pytest.approx(128 + 127 * contrast, abs=1)


def test_a_tip_beyond_the_picture_is_simply_not_in_it() -> None:
    narrow = PLAIN.model_copy(update={"height_above": -0.2})
    assert Scene(narrow, WRIST).render(bent(0.0), np.random.default_rng(0)).shape == (480, 640)
    half = PLAIN.model_copy(update={"height_above": WRIST.length - 0.12})
    assert set(Detector().everywhere(Scene(half, WRIST).render(bent(0.0), np.random.default_rng(0)))) <= {0, 1}


def film(**changes: float) -> Film:
    return Film(PLAIN.model_copy(update={"width": 161, "height": 121, **changes}))


def exposed(of: Film, grey: float = 100.0, instants: int = 1) -> np.ndarray:
    total = np.full((121, 161), grey * instants, np.float32)
    return of.expose(total, instants, np.random.default_rng(0)).astype(float)


def test_light_falls_from_the_upper_left_by_its_gradient_and_is_whole_in_the_middle() -> None:
    picture = exposed(film(gradient=0.5))
    assert picture[60, 80] == 100.0
    assert picture[60, 0] - picture[60, -1] == pytest.approx(100 * 0.5 * 0.6, abs=1.0)
    assert picture[0, 80] - picture[-1, 80] == pytest.approx(100 * 0.5 * 0.8, abs=1.0)


@pytest.mark.parametrize("instants", [1, 4])
def test_a_sum_of_instants_is_exposed_as_their_mean(instants: int) -> None:
    assert (exposed(film(), instants=instants) == 100.0).all()


def test_blur_spreads_a_point_by_its_deviation() -> None:
    total = np.zeros((121, 161), np.float32)
    total[60, 80] = 40_000.0
    picture = film(blur=4.0).expose(total, 1, np.random.default_rng(0)).astype(float)
    x = np.arange(161) - 80.0
    shares = picture.sum(axis=0) / picture.sum()
    assert math.sqrt(float((shares * x**2).sum())) == pytest.approx(4.0, rel=0.05)
    total = np.zeros((121, 161), np.float32)
    total[60, 80] = 200.0
    assert (film(blur=0.0).expose(total, 1, np.random.default_rng(0)) > 0).sum() == 1


def test_noise_is_normal_with_its_deviation_and_greys_end_at_black_and_white() -> None:
    noise = exposed(film(noise=6.0)) - 100.0
    assert noise.std() == pytest.approx(6.0, rel=0.03) and abs(noise.mean()) < 0.2
    assert np.mean(np.abs(noise) < 6.0) == pytest.approx(0.68, abs=0.05)
    assert exposed(film(noise=30.0), 250.0).max() == 255.0 and exposed(film(noise=30.0), 5.0).min() == 0.0
