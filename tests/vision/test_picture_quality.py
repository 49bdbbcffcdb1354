"""Size, sharpness and light of a marker's picture are those that the scene was rendered with."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.detector import PictureQuality, quality_of
from wristctl.vision.marker import Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View


def quality(**changes: float) -> PictureQuality:
    scene = Scene(SceneSettings.model_validate(changes), WristParameters())
    image = scene.render(np.full((1, 4), 0.05), np.random.default_rng(0))
    seen = Tracker(Markers(), View(), Gates()).see(Frame(image, 0.0, 0))
    return quality_of(image, seen.corners[1])


@pytest.mark.parametrize("blur", [0.8, 1.2, 1.6])
def test_blur_is_the_lenss_and_the_pixels(blur: float) -> None:
    pixel = 1.0 / np.sqrt(6.0)  # a pixel's own width and that of interpolation between two
    assert quality(blur=blur).blur == pytest.approx(np.hypot(blur, pixel), rel=0.15)


def test_side_and_greys_follow_distance_and_print() -> None:
    near, far = quality(distance=0.27), quality(distance=0.33)
    ratio = (0.33 - 0.028) / (0.27 - 0.028)  # the flags stand before the plane
    assert near.side / far.side == pytest.approx(ratio, rel=0.01)
    strong, weak = quality(), quality(contrast=0.3)
    assert strong.white - strong.black > 2.0 * (weak.white - weak.black) > 100.0
    assert strong.black < weak.black < weak.white < strong.white
