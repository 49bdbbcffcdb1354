"""The tracker on rendered pictures: accuracy, and every gate."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from wristctl.config.vision import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.hardware.vision.camera import Frame
from wristctl.hardware.vision.marker import Tracker, Verdict
from wristctl.hardware.vision.scene import Scene

RATE = 60.0


@pytest.fixture(autouse=True)
def one_thread() -> None:
    cv2.setNumThreads(1)


def bent(degrees: float) -> np.ndarray:
    return np.full((1, 4), np.radians(degrees) / 4)


def errors(scene: Scene, tracker: Tracker, degrees: np.ndarray, seed: int = 0) -> np.ndarray:
    """Errors [deg] of the angle, one frame after the other."""
    rng, found = np.random.default_rng(seed), []
    for number, angle in enumerate(degrees):
        sighting = tracker.see(Frame(scene.render(bent(angle), rng), number / RATE, number))
        assert sighting.verdict is Verdict.OK
        found.append(np.degrees(sighting.theta) - angle)
    return np.array(found)


@pytest.mark.parametrize("distance", [0.30, 0.21, 0.165])  # 41, 61 and 81 px
def test_angle_is_right_within_a_tenth_of_a_degree_at_40_to_80_px(distance: float) -> None:
    scene = Scene(SceneSettings(distance=distance, height_above=0.019, noise=4.0), WristParameters(length=0.06))
    off = errors(scene, Tracker(Markers(), scene.view, Gates()), np.linspace(-40.0, 40.0, 40))
    assert off.std() <= 0.1
    assert abs(off.mean()) <= 0.15  # what calibrating the straight wrist's angle takes away
