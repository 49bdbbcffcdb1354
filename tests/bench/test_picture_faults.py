"""Each way of spoiling a picture does what it says, and leaves the picture itself alone."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.bench.shutter import PICTURE_FAULTS, spoiled
from wristctl.config.camera import SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.detector import Detector
from wristctl.vision.scene import Scene

PICTURE = Scene(SceneSettings(), WristParameters()).render(np.full((1, 4), 0.05), np.random.default_rng(0))
BEFORE = PICTURE.copy()


def of(kind: str, size: float = 1.0, number: int = 7) -> np.ndarray:
    made = spoiled(PICTURE, kind, size, number, np.random.default_rng(1))  # type: ignore[arg-type]
    assert made.shape == PICTURE.shape and made.dtype == np.uint8 and (PICTURE == BEFORE).all()
    return made


@pytest.mark.parametrize("kind", PICTURE_FAULTS)
def test_it_is_another_picture(kind: str) -> None:
    assert (of(kind, 3.0) != PICTURE).any()


def test_light_scales_and_a_picture_saturates() -> None:
    assert of("picture-dark", 0.1).max() <= 26 and of("picture-bright", 1.5).mean() > PICTURE.mean() * 1.3
    assert (of("picture-bright", 3.0) == 255).mean() > 0.5


@pytest.mark.parametrize(("kind", "size", "of_black", "of_grey"), [
    ("picture-dark", 0.1, 0, 10), ("picture-bright", 1.5, 0, 150), ("picture-bright", 2.0, 0, 200),
    ("picture-bright", 2.1, 60, 255), ("picture-dark", 2.1, 0, 210),
])  # fmt: skip
def test_black_stays_black_but_where_light_is_so_strong_that_it_hazes(
    kind: str, size: float, of_black: int, of_grey: int
) -> None:
    halves = np.repeat(np.array([0, 100], np.uint8), 50).reshape(2, 50)
    made = spoiled(halves, kind, size, 0, np.random.default_rng(1))  # type: ignore[arg-type]
    assert (np.abs(made.astype(int) - [[of_black], [of_grey]]) <= 1).all()


def test_a_moved_camera_moves_everything_and_a_mirror_shows_no_marker() -> None:
    assert (of("picture-shifted", 20.0)[:, 20:] == PICTURE[:, :-20]).all()
    assert (of("picture-mirrored")[:, ::-1] == PICTURE).all()
    corners, turned = (
        Detector().everywhere(each)[1][0].mean(axis=0) for each in (PICTURE, of("picture-turned", 180.0))
    )
    assert corners + turned == pytest.approx([640.0, 480.0], abs=2.0)
    assert not Detector().everywhere(of("picture-mirrored")) and not Detector().everywhere(of("picture-other"))


def test_blur_and_smear_take_the_edges() -> None:
    sharp = np.abs(np.diff(PICTURE.astype(float), axis=1)).mean()
    for kind, size in (("picture-blurred", 3.0), ("picture-smeared", 15.0)):
        assert np.abs(np.diff(of(kind, size).astype(float), axis=1)).mean() < 0.4 * sharp
    along = np.abs(np.diff(of("picture-smeared", 15.0).astype(float), axis=0)).mean()
    assert along > 1.5 * np.abs(np.diff(of("picture-smeared", 15.0).astype(float), axis=1)).mean()


def test_a_second_marker_is_one_and_a_clock_changes_one_pixel() -> None:
    assert len(Detector().everywhere(of("marker-twice", 1.0))[1]) == 2
    assert (of("camera-frozen-clock") != PICTURE).sum() <= 1 and of("camera-frozen-clock", number=263)[0, 0] == 7
