"""Stick and slip: a staircase under a ramp, whose rests and jumps are known, in one plane and in two."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.simulation.metrics import METRICS
from wristctl.simulation.stick_slip import jump, plateau
from wristctl.simulation.trajectory import Trajectory

TIME = np.arange(2000, dtype=np.float64) * 1e-3
RAMP = math.radians(10.0) * TIME
# Rests of 0.4 s under a ramp of 10 deg/s, each made up for at once.
STAIRS = math.radians(10.0) * 0.4 * np.floor(TIME / 0.4 + 1e-9)


def course(bend: np.ndarray[Any, Any], wanted: np.ndarray[Any, Any]) -> Trajectory:
    still: dict[str, Any] = {name: np.zeros_like(bend) for name in ("rate", "torque_wanted", "torque", "segment_theta")}
    tip = np.zeros((len(TIME), 2 if bend.ndim == 1 else 3))
    return Trajectory(
        label="", time=TIME, theta=bend, theta_ref=wanted, theta_desired=wanted, tip=tip, tip_desired=tip,
        tension=np.zeros((len(TIME), 2)), **still,
    )  # fmt: skip


@pytest.mark.parametrize("toward", [None, 0.0, 0.7])
def test_rests_and_jumps_of_a_staircase_are_its_steps_in_any_direction(toward: float | None) -> None:
    """A step of 4 deg within a sample, while the ramp goes on by 1 deg in 0.1 s."""

    def aimed(path: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return path if toward is None else path[:, None] * np.array([math.cos(toward), math.sin(toward)])

    stuck = course(aimed(STAIRS), aimed(RAMP))
    assert plateau(stuck) == pytest.approx(0.399), "between the samples of the two steps"
    assert jump(stuck) == pytest.approx(math.radians(4.0 - 1.0), rel=1e-9)
    assert METRICS["plateau"].of_trajectory is plateau and METRICS["jump"].of_trajectory is jump


def test_a_wrist_that_follows_or_has_nothing_to_follow_neither_rests_nor_jumps() -> None:
    for bend, wanted in ((RAMP - 0.01, RAMP), (0.0 * RAMP, 0.0 * RAMP + 0.2), (STAIRS, math.radians(0.9) * TIME)):
        assert plateau(course(bend, wanted)) == jump(course(bend, wanted)) == 0.0


def test_a_slow_start_is_a_rest_without_a_jump_and_a_short_rest_has_none() -> None:
    late = math.radians(10.0) * np.maximum(TIME - 0.3, 0.0)
    assert plateau(course(late, RAMP)) == pytest.approx(0.3)
    assert jump(course(late, RAMP)) == pytest.approx(0.0, abs=1e-12)
    brief = math.radians(10.0) * 0.04 * np.floor(TIME / 0.04 + 1e-9)
    assert 0.0 < plateau(course(brief, RAMP)) < 0.05 and jump(course(brief, RAMP)) == 0.0


@pytest.mark.parametrize(("rest", "jumps"), [(0.04, False), (0.06, True), (0.09, True)])
def test_a_rest_of_a_twentieth_of_a_second_or_longer_can_end_in_a_jump(rest: float, jumps: bool) -> None:
    """A ramp with one rest, then 4 deg ahead: the rest is made up for, from its last sample on, and 4 deg more."""
    bend = np.where(TIME < 1.0, RAMP, RAMP + math.radians(4.0))
    bend[1000 : 1000 + round(1000 * rest)] = math.radians(10.0)
    ahead = 4.0 + 10.0 * (rest - 1e-3)
    assert jump(course(bend, RAMP)) == pytest.approx(math.radians(ahead) if jumps else 0.0, abs=1e-9)


def test_nothing_is_told_of_a_wrist_that_has_failed() -> None:
    gone = np.where(TIME < 1.0, STAIRS, np.nan)
    assert math.isnan(plateau(course(gone, RAMP))) and math.isnan(jump(course(gone, RAMP)))
