"""Corners are where the sides of a square meet, whatever its angle and place among the pixels."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from tests.vision.conftest import Array, frames
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.detector import outlined, square_angle
from wristctl.vision.marker import Tracker
from wristctl.vision.scene import Scene

SIZE, CELLS = 80, 6


def square(angle: float, side: float, centre: tuple[float, float]) -> Array:
    """Corners (4, 2) [px] of a square turned by an angle [rad], clockwise from the upper left."""
    z = 0.5 * side * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j]) * np.exp(1j * angle)
    return np.stack([z.real, z.imag], axis=1) + centre


def drawn(angle: float, side: float, centre: tuple[float, float], blur: float = 0.8) -> Array:
    """A black square on white behind a Gaussian blur [px], in closed form."""
    x, y = np.meshgrid(np.arange(SIZE) - centre[0], np.arange(SIZE) - centre[1])
    z = (x + 1j * y) * np.exp(-1j * angle)
    along, across = (ndtr((each + 0.5 * side) / blur) - ndtr((each - 0.5 * side) / blur) for each in (z.real, z.imag))
    return 224.0 - 192.0 * along * across


@settings(max_examples=25, deadline=None)
@given(
    angle=st.floats(-0.8, 0.8),
    side=st.floats(36.0, 50.0),
    x=st.floats(39.0, 40.0),
    y=st.floats(39.0, 40.0),
    seed=st.integers(0, 1000),
)
def test_corners_are_found_to_a_twentieth_of_a_pixel_from_a_pixel_off(
    angle: float, side: float, x: float, y: float, seed: int
) -> None:
    corners = square(angle, side, (x, y))
    rough = corners + np.random.default_rng(seed).uniform(-1.0, 1.0, (4, 2))
    found = outlined(np.rint(drawn(angle, side, (x, y))).astype(np.uint8), rough, CELLS)
    assert np.abs(found - corners).max() < 0.05
    assert abs(np.degrees(square_angle(found) - angle)) < 0.05


def test_the_angle_of_a_noiseless_picture_is_off_by_no_function_of_the_angle() -> None:
    """Corners that are refined one by one are off by 0.1 deg, as sin(4 angle)."""
    degrees = np.arange(-32.0, 33.0, 2.0)
    scene = Scene(SceneSettings(noise=0.0), WristParameters())
    tracker = Tracker(Markers(), scene.view, Gates(rate=1e3))
    off = np.degrees([tracker.see(frame).theta for frame in frames(scene, degrees)]) - degrees
    assert off.std() < 0.012
    assert abs(off.mean()) < 0.05
