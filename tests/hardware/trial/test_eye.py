"""What the loop is told of the camera's pictures."""

from __future__ import annotations

import math

import numpy as np

from wristctl.config.vision import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.hardware.trial.eye import InlineEye
from wristctl.hardware.vision.camera import Frame
from wristctl.hardware.vision.marker import Tracker, Verdict
from wristctl.hardware.vision.scene import Scene
from wristctl.hardware.vision.view import View


class Shown:
    """A camera that shows these pictures, one at each look."""

    name = "shown"

    def __init__(self, images: list[np.ndarray]) -> None:
        self._frames = [Frame(image, number / 60.0, number) for number, image in enumerate(images)]

    def newest(self) -> Frame | None:
        return self._frames.pop(0) if self._frames else None

    def close(self) -> None:
        """Nothing is open."""


def test_the_same_bytes_again_are_no_angle_and_another_picture_of_the_same_wrist_is() -> None:
    scene, rng = Scene(SceneSettings(), WristParameters()), np.random.default_rng(0)
    first, second = (scene.render(np.full((1, 4), 0.05), rng) for _ in range(2))
    eye = InlineEye(Shown([first, first.copy(), second, second.copy()]), Tracker(Markers(), View(), Gates()))
    seen = [eye.look()[0] for _ in range(4)]
    assert [each.verdict for each in seen] == [Verdict.OK, Verdict.FROZEN, Verdict.OK, Verdict.FROZEN]
    assert [math.isnan(each.theta) for each in seen] == [False, True, False, True]
    assert eye.look() == []
