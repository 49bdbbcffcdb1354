"""What a frame of the bench's camera is made of, and its picture."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.seeds import Entropy
from wristctl.vision.camera import Frame, Image


class Painter(Protocol):
    """What draws the wrist: `vision.scene.Scene`."""

    def render(self, theta: Array, rng: np.random.Generator, covered: bool = False, swapped: bool = False) -> Image:
        """The picture of segment angles (k, n) at k instants of the exposure."""


class Exposure(NamedTuple):
    """All that a frame's picture is made of; what a frozen camera shows is another frame's."""

    number: int
    time: float
    """middle of the exposure [s]"""
    shown: int
    theta: Array
    """(k, n) of k parts of the exposure [rad]"""
    covered: bool
    swapped: bool
    noise: Entropy
    """of the `shown` frame's random stream: its first number decides whether it is lost, the others are its noise"""


def picture(exposure: Exposure, painter: Painter) -> Frame:
    """Draw it; of one `shown` frame always the same."""
    rng = np.random.default_rng(exposure.noise)
    rng.random()
    image = painter.render(exposure.theta, rng, covered=exposure.covered, swapped=exposure.swapped)
    return Frame(image, exposure.time, exposure.number)
