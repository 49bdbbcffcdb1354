"""What is fixed to the last disc moves with it, as a rod of constant curvature in both planes carries it."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.distance import pdist

from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.scene_parts import bent_across, with_last_disc

LENGTH = 0.08
PRINT = np.array([[0.01, 0.012, -0.028], [0.01, -0.012, -0.028], [-0.014, 0.012, -0.028], [-0.014, -0.012, -0.028]])


def _disc(theta: float) -> tuple[complex, complex]:
    """Centre and normal of the last disc of one planar arc."""
    end = LENGTH * (cmath.exp(1j * theta) - 1.0) / (1j * theta) if theta else complex(LENGTH)
    return end, cmath.exp(1j * theta)


def _print_on(theta: float) -> np.ndarray:
    """A marker's corners on the disc of a wrist that is bent in its plane only."""
    centre, normal = _disc(theta)
    places = centre + normal * (PRINT[:, 0] + 1j * PRINT[:, 1])
    return np.stack([places.real, places.imag, PRINT[:, 2]], axis=1)


def _rod(theta: float, bend: float) -> tuple[np.ndarray, np.ndarray]:
    """End and orientation of a rod whose curvature is constant in its own axes, integrated along its length."""
    curvature = np.cross(np.array([0.0, -bend, theta]) / LENGTH, np.eye(3)).T

    def along(_: float, state: np.ndarray) -> np.ndarray:
        turned = state[3:].reshape(3, 3)
        return np.concatenate([turned[:, 0], (turned @ curvature).ravel()])

    begin = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    end = solve_ivp(along, (0.0, LENGTH), begin, rtol=1e-10, atol=1e-13).y[:, -1]
    return end[:3], end[3:].reshape(3, 3)


@given(st.floats(-0.9, 0.9).filter(lambda theta: abs(theta) > 1e-6), st.floats(-0.15, 0.15))
def test_a_marker_goes_where_a_rod_of_constant_curvature_takes_it(theta: float, bend: float) -> None:
    end, turned = _rod(theta, bend)
    expected = end + PRINT @ turned.T
    moved = with_last_disc(_print_on(theta), bend, LENGTH, _disc(theta))
    assert moved == pytest.approx(expected, abs=1e-8)
    assert pdist(moved) == pytest.approx(pdist(PRINT), abs=1e-12)


def test_a_straight_wrists_marker_is_carried_as_its_other_parts_are() -> None:
    above = PRINT + np.array([LENGTH + 0.02, 0.0, 0.0])
    assert with_last_disc(above, 0.1, LENGTH, (complex(LENGTH), 1.0 + 0.0j)) == pytest.approx(
        bent_across(above, 0.1, LENGTH)
    )


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 30.0])
def test_the_markers_size_tells_the_bend_across_wherever_the_wrist_is(degrees: float) -> None:
    """As the loop reads it, to a fifth and a frame's noise."""
    wrist, markers = WristParameters(), Markers()
    scene, rng = Scene(SceneSettings(), wrist, markers), np.random.default_rng(0)
    tracker = Tracker(markers, scene.view, Gates())
    angles = np.full((1, 4), math.radians(degrees) / 4.0)
    sizes = []
    for number in range(36):
        across = math.radians((0.0, -2.0, 2.0)[number // 12])
        seen = tracker.see(Frame(image=scene.render(angles, rng, across=across), time=number / 60.0, number=number))
        sizes.append(seen.size)
    straight, nearer, away = np.log(np.reshape(sizes, (3, 12))).mean(axis=1)
    bends = np.rad2deg(-2.0 * markers.distance / wrist.length * (np.array([nearer, away]) - straight))
    assert bends == pytest.approx([-2.0, 2.0], abs=0.5)
