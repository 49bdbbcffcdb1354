"""What the loop is told of the camera's pictures."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.tracking import InlineTracking, ThreadedTracking
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View


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
    tracking = InlineTracking(Shown([first, first.copy(), second, second.copy()]), Tracker(Markers(), View(), Gates()))
    seen = [tracking.look()[0] for _ in range(4)]
    assert [each.verdict for each in seen] == [
        SightingVerdict.OK,
        SightingVerdict.FROZEN,
        SightingVerdict.OK,
        SightingVerdict.FROZEN,
    ]
    assert [math.isnan(each.theta) for each in seen] == [False, True, False, True]
    assert tracking.look() == []


@pytest.mark.parametrize("kind", [InlineTracking, ThreadedTracking])
def test_what_is_kept_of_a_frame_is_what_the_loop_is_told(kind: type[InlineTracking | ThreadedTracking]) -> None:
    """The angle from zero, not from wherever the markers were glued on."""
    scene, kept, done = Scene(SceneSettings(), WristParameters()), [], threading.Event()

    def keep(frame: Frame, seen: Sighting) -> None:
        kept.append(seen)
        done.set()

    camera = Shown([])
    tracking = kind(camera, Tracker(Markers(), View(), Gates()), keep)
    tracking.zero = (0.1,)
    camera._frames.append(Frame(scene.render(np.full((1, 4), 0.05), np.random.default_rng(0)), 0.0, 0))
    told = tracking.look()
    assert done.wait(30.0)
    told = told or tracking.look()
    tracking.close()
    assert [each.theta for each in kept] == [each.theta for each in told]
    assert told[0].theta == pytest.approx(0.1, abs=0.01)
