"""The drawn wrist is the model's: arcs, straight tendons, discs across the backbone."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.report.wrist_drawing import directions, stroboscope
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.directions import DIRECTIONS, TENDONS
from wristctl.wrist.kinematics import chain_tip
from wristctl.wrist.shape import arcs_backbone, discs, offset_points

WRIST = WristParameters()
L, C = WRIST.length, WRIST.tendon_offset


@pytest.mark.parametrize("angles", [[0.0], [0.7], [-1e-9], [0.3, -0.2, 0.5, 0.1], [1.0, 1.0, 1.0]])
def test_last_disc_sits_at_the_tip_and_stands_across_it(angles: list[float]) -> None:
    theta = np.array(angles)
    centres, normals = discs(arcs_backbone, theta, WRIST)
    x, y = chain_tip(theta[None], L)[0]
    assert centres[-1] == pytest.approx(x + 1j * y, abs=1e-15)
    assert normals[-1] == pytest.approx(np.exp(1j * theta.sum()))
    assert centres[0] == 0.0 and normals[0] == 1.0


def test_backbone_keeps_its_length_and_its_tangent() -> None:
    theta = np.array([0.3, -0.2, 0.5, 0.1])
    at = np.linspace(0.0, L, 4001)
    points, tangents = arcs_backbone(WRIST, theta, at)
    steps = np.diff(points)
    assert np.abs(steps).sum() == pytest.approx(L, rel=1e-6)
    assert np.abs(steps / np.abs(steps) - tangents[:-1]).max() < 1e-3


@pytest.mark.parametrize("theta", [0.6, -0.4])
def test_drawn_tendons_have_the_models_length(theta: float) -> None:
    frames = discs(arcs_backbone, np.array([theta]), WRIST)
    for sign in (1, -1):
        drawn = np.abs(np.diff(offset_points(frames, sign * C))).sum()
        assert drawn == pytest.approx(2 * 4 * (L / theta - sign * C) * np.sin(theta / 8), rel=1e-12)


def test_pulling_tendons_are_those_of_the_paper_and_lie_on_the_side_of_the_bend() -> None:
    pulled = {each.name: each.tendons for each in DIRECTIONS.values()}
    assert pulled == {"ulnar": (4, 5), "radial": (1, 2), "flexion": (2, 5), "extension": (1, 4)}
    for each in DIRECTIONS.values():
        axis = 0 if each.plane == "ulnar" else 1
        assert all(TENDONS[number][axis] == each.sign for number in each.tendons)


def test_hand_without_an_offset_is_left_out() -> None:
    shown, hidden = (directions(WRIST.model_copy(update={"hand_offset": h})) for h in (0.06, 0.0))
    assert len(shown.axes[0].patches) > len(hidden.axes[0].patches)


def test_stroboscope_shows_the_move_from_start_to_rest(course: Callable[..., Trajectory]) -> None:
    made = stroboscope(course("smc/tuned", tau=0.3), WRIST, count=4)
    ticks = made.axes[1].get_yticks()
    assert len(ticks) == 4 and ticks[0] == 0.0
    assert ticks[-1] == pytest.approx(0.3 * np.log(50.0), abs=0.025)


def test_stroboscope_of_a_diverging_move_shows_what_is_known(course: Callable[..., Trajectory]) -> None:
    made = stroboscope(course("smc/tuned", diverges=True), WRIST)
    assert 0.0 < made.axes[1].get_yticks()[-1] < 2.0


def test_stroboscope_of_a_wrist_that_stays_still_covers_the_whole_time(course: Callable[..., Trajectory]) -> None:
    moved = course("smc/printed")
    still = dataclasses.replace(moved, theta=0.0 * moved.theta, segment_theta=0.0 * moved.segment_theta)
    assert stroboscope(still, WRIST).axes[1].get_yticks()[-1] == pytest.approx(moved.time[-1])
