"""Made-up runs are judged right or wrong as the words of docs/hardware/faults.md say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.trial.fault_cases import Case
from tests.trial.fault_judging import Course, Judged, judge

TIME = np.arange(0.0, 40.0, 0.01)
MOVES = np.concatenate([np.arange(10.0, 11.0, 0.01), np.arange(12.0, 13.0, 0.01), np.arange(30.0, 31.0, 0.01)])
"""There and back in one plane, and the next plane's motion; faults at rest come at 11.5 s."""
SOUND = Course(
    10.0, TIME, 0.0 * TIME, 0.0 * TIME, 9.0 + 0.0 * TIME, math.radians(0.2), math.inf, 33.0, "", "", 0, "", MOVES
)


def stopped(at: float, pull: float = 9.0, **changes: Any) -> Course:
    made = SOUND._replace(decided=at, last_step=at + 0.02, reason="stopped", code=5, pull=pull + 0.0 * TIME)
    return made._replace(**changes)


def held(course: Course, *cases: Case) -> Judged:
    return judge(cases, "holding", course, SOUND)


AT_ONCE, BY_THE_WRIST = Case("one", "camera-frozen", shows="at once"), Case("other", "motor-stalled")
BORNE = Case("borne", "stamps-shifted", ends={"holding": ("caught", "tolerated")}, shows="at once")


@pytest.mark.parametrize(("late", "right"), [(0.39, True), (0.41, False), (1.2, False), (5.0, False)])
def test_what_shows_at_once_is_caught_in_time_or_wrong_however_long_nothing_moves(late: float, right: bool) -> None:
    assert held(stopped(11.5 + late), AT_ONCE).right is right


@pytest.mark.parametrize(("at", "right"), [(20.9, True), (30.2, False)])
def test_what_comes_out_in_small_moves_creeps_and_in_a_motion_it_does_not(at: float, right: bool) -> None:
    """It is seen on the wrist after 20 s, which is long after the last motion; the next one begins at 30 s."""
    off = np.where((20.0 if at < 30.0 else 29.5) < TIME, 0.1, 0.0)
    assert held(stopped(at, angle=off), BY_THE_WRIST).right is right


def test_pull_and_an_exit_code_that_is_no_stop_make_it_wrong() -> None:
    assert held(stopped(11.6, pull=59.0), AT_ONCE).right and not held(stopped(11.6, pull=61.0), AT_ONCE).right
    assert not held(stopped(11.6, code=1), AT_ONCE).right


@pytest.mark.parametrize(
    ("error", "pull", "odd", "right"),
    [(1.9, 29.0, "a word", True), (2.1, 29.0, "a word", False), (1.9, 31.0, "a word", False), (1.9, 29.0, "", False)],
)
def test_what_is_tolerated_does_little_harm_and_is_named(error: float, pull: float, odd: str, right: bool) -> None:
    course = SOUND._replace(error=math.radians(error), pull=pull + 0.0 * TIME, odd=odd)
    assert held(course, BORNE).right is right
    assert not held(course, AT_ONCE).right, "it must be caught"


def test_of_two_the_one_that_must_be_caught_sets_the_time() -> None:
    off = np.where(TIME > 12.3, 0.1, 0.0)  # on the way back
    late = stopped(12.5, angle=off)
    assert held(late, BORNE, BY_THE_WRIST).right and held(late, BY_THE_WRIST, BORNE).right
    assert not held(stopped(12.9, angle=off), BORNE, BY_THE_WRIST).right
    assert not held(late, AT_ONCE, BY_THE_WRIST).right, "the first was to be caught by 11.9 s"
