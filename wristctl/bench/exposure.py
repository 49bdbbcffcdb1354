"""What a frame of the bench's camera is made of, and its picture."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.picture_faults import spoiled
from wristctl.config.injected import FaultKind
from wristctl.seeds import Entropy
from wristctl.vision.camera import Frame, Image


class Painter(Protocol):
    """What draws the wrist: `vision.scene.Scene`."""

    def render(
        self, theta: Array, rng: np.random.Generator, covered: bool = False, swapped: bool = False,
        across: float = 0.0, turned: float = 0.0,
    ) -> Image:  # fmt: skip
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
    across: float = 0.0
    """bend across the plane, away from the camera [rad]"""
    turned: float = 0.0
    """by how much the tip's marker has slipped [rad]"""
    spoiled: tuple[tuple[FaultKind, float], ...] = ()
    """kinds and sizes of what spoils the picture"""


def picture(exposure: Exposure, painter: Painter) -> Frame:
    """Draw it; of one `shown` frame always the same."""
    rng = np.random.default_rng(exposure.noise)
    rng.random()
    image = painter.render(
        exposure.theta, rng, exposure.covered, exposure.swapped, exposure.across, exposure.turned
    )  # fmt: skip
    for kind, size in exposure.spoiled:
        image = spoiled(image, kind, size, exposure.number, rng)
    return Frame(image, exposure.time, exposure.number)
