"""Rendered pictures for the tests of what reads them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.config.camera import SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.scene import Scene

FRAME_RATE = 60.0

Array = NDArray[np.float64]


@pytest.fixture(autouse=True)
def one_thread() -> None:
    cv2.setNumThreads(1)


@pytest.fixture(scope="session")
def scene() -> Scene:
    return Scene(SceneSettings(), WristParameters())


def bent(degrees: float) -> Array:
    """One instant of a wrist of four equal segments."""
    return np.full((1, 4), np.radians(degrees) / 4)


def frames(scene: Scene, degrees: Array, **faults: bool) -> list[Frame]:
    """A frame for each angle."""
    rng = np.random.default_rng(0)
    return [Frame(scene.render(bent(each), rng, **faults), k / FRAME_RATE, k) for k, each in enumerate(degrees)]
