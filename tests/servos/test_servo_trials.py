"""Trials on emulated servos: sound ones end well, and no fault ends as if nothing had been."""

from __future__ import annotations

import re

import pytest

from tests.servos.fault_trials import tried

SAID = {
    "detached": r"the tendon of target 2 is off its pulley, cut or slipped",
    "stalled": r"stall: servo 2|tendons 2",
    "exchanged": r"target 2 bends the wrist toward 2\d\d deg, and tendon 2 is at 120 deg: as tendon 3 would",
    "shut-down": r"overload: servo 2 \(tendon 2\) has shut down",
    "unplugged": r"no answer from servo 2 \(tendon 2\) and servo 3 \(tendon 3\); others answer",
    "id-missing": r"no servo answers as id 2",
    "id-doubled": r"answers of id 2 collide",
    "late-bus": r"no servo answers in time",
    "stale-position": r"stall: servo 2 \(tendon 2\) stands [\d.]+ mm off its goal; its gear",
    "hot": r"heat: servo 2 \(tendon 2\) is at 75 degrees",
    "wrong-zero": r"wrong zero: the position of servo 2 \(tendon 2\) jumps by \d\d",
    "wrong-bend": r"stopped: ",
}
"""What is said of the faults of servo 2 that a trial does not survive."""


@pytest.mark.slow
@pytest.mark.parametrize(("tendons", "motion"), [(3, "dart-thrower"), (4, "circumduction")])
def test_servos_are_homed_and_follow_a_motion_in_two_planes(tendons: int, motion: str) -> None:
    came = tried("", tendons=tendons, motion=motion)
    assert came.outcome == "ok" and came.lost == 0 and came.slack_error < 5e-5
    assert came.error_deg < 0.5 and came.largest_pull < came.limit


@pytest.mark.slow
def test_a_motion_too_quick_for_the_servos_current_is_followed_as_far_as_it_goes() -> None:
    came = tried("", motion="dart-thrower", angle_deg=30.0)
    assert came.outcome == "ok", "where the servos are says that no tendon pulls by their limit"
    assert 1.0 < came.error_deg < 5.0 and came.largest_pull < 0.6 * came.limit


@pytest.mark.slow
def test_answers_that_are_lost_now_and_then_change_nothing_that_matters() -> None:
    came = tried("packet-lost")
    assert came.outcome == "ok" and came.lost > 20 and came.error_deg < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("fault", SAID)
def test_a_fault_stops_the_trial_and_is_said_and_nothing_pulls_beyond_the_limit(fault: str) -> None:
    came = tried(fault)
    assert came.outcome != "ok" and re.search(SAID[fault], came.outcome), came
    assert came.largest_pull < 1.1 * came.limit
    if fault == "shut-down":
        assert came.named_within < 0.1
