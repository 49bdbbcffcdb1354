"""The rules of the audit at their boundaries: at, just inside and just outside of each, and what fails."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wristctl.comparison.paper import Ends
from wristctl.comparison.repetition_spread import spread
from wristctl.comparison.verdicts import joint, of_numbers, of_ordering, of_sample, of_settling
from wristctl.config.audit import VerdictName

HAIR = 1e-9
NEVER = math.nan
OPEN, BETTER, WORSE = "not specified enough", "better than the paper", "worse than the paper"
FAILS = "does not hold"


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        (2.0, 2.0, "reproduced"),
        (3.0 * (1 - HAIR), 11.0, "reproduced"),  # ours above, within a factor of 1.5
        (3.0, 3.0, "reproduced"),
        (3.0 * (1 + HAIR), 11.0, WORSE),
        (0.5, 2.0 / 1.5 * (1 + HAIR), "reproduced"),  # ours below
        (0.5, 2.0 / 1.5 * (1 - HAIR), BETTER),
        (1.0, 4.0 * (1 - HAIR), "reproduced"),  # around the paper's, less than a factor of 4 apart
        (1.0, 4.0, OPEN),
        (4.0, 1.0, OPEN),
        (10.0, 1000.0, WORSE),  # beyond it on every motion, however far apart
        (1e-9, 1e-3, BETTER),
        (0.0, 0.0, BETTER),
        (0.0, 2.0, OPEN),
        (2.0, NEVER, OPEN),  # nothing lies between a number and never
        (1e-9, NEVER, OPEN),
        (4.0, NEVER, WORSE),
        (2.0, math.inf, OPEN),
        (NEVER, NEVER, WORSE),
    ],
)
def test_a_number_is_judged_on_both_sides_and_never_by_what_failed(one: float, other: float, verdict: str) -> None:
    assert of_numbers(2.0, [one, other]).verdict == of_numbers(2.0, [other, one]).verdict == verdict


@given(st.floats(1e-6, 1e6), st.floats(1e-3, 1e3), st.floats(1.0, 10.0), st.floats(1e-3, 1e3))
def test_verdicts_know_no_unit(paper: float, ratio: float, apart: float, scale: float) -> None:
    """A log scale: whatever the unit, and mirrored where both are turned into their inverse."""
    edges = ratio / 1.5, ratio * 1.5, ratio * apart / 1.5, ratio * apart * 1.5, apart / 4.0
    assume(min(abs(each - 1.0) for each in edges) > 1e-6)  # there rounding decides
    ours = [paper * ratio, paper * ratio * apart]
    found = of_numbers(paper, ours)
    assert found.verdict == of_numbers(scale * paper, [scale * each for each in ours]).verdict
    turned = {BETTER: WORSE, WORSE: BETTER}
    mirrored = of_numbers(1.0 / paper, [1.0 / each for each in ours]).verdict
    assert mirrored == turned.get(found.verdict, found.verdict)


def test_a_range_holds_finite_numbers_only() -> None:
    found = of_numbers(2.0, [NEVER, 3.5])
    assert (found.low, found.high) == (3.5, 3.5) and found.verdict == WORSE
    nothing = of_numbers(2.0, [NEVER])
    assert np.isnan([nothing.low, nothing.high]).all() and "never" in nothing.reason


def test_bounds_hold_at_their_value_and_not_a_hair_beyond() -> None:
    assert of_numbers(1e-6, [1e-6, 0.0], "at most").verdict == "reproduced"
    assert of_numbers(1e-6, [1e-6 * (1 + HAIR)], "at most").verdict == FAILS
    assert of_numbers(1e-6, [1e-6, 2e-6], "at most").verdict == OPEN
    assert of_numbers(1e-6, [0.0, NEVER], "at most").verdict == OPEN
    assert of_numbers(1.0, [1.0], "at least").verdict == "reproduced"
    assert of_numbers(1.0, [1.0 - HAIR], "at least").verdict == FAILS
    assert of_numbers(3.0, [3.0], "exactly").verdict == "reproduced"
    assert of_numbers(3.0, [4.0], "exactly").verdict == FAILS


def test_a_perfect_follower_of_any_motion_reproduces_no_settling_time() -> None:
    """It is within the band before the motion ends: its time would be that of the motion which we chose."""
    for paper in (1.02, 1.2, 2.8, 3.0, 3.18):
        assert of_settling(paper, [0.0, 0.0], [1.0, 2.0]).verdict == OPEN
    assert of_settling(1.2, [1.2 * 1.5, 9.0], [1.0, 2.0]).verdict == OPEN
    assert of_settling(1.2, [1.8 * (1 + HAIR), 5.0], [1.0, 2.0]).verdict == WORSE
    assert of_settling(1.2, [NEVER, NEVER], [1.0, 2.0]).verdict == WORSE
    assert of_settling(1.2, [0.0, NEVER], [1.0, 2.0]).verdict == OPEN


@pytest.mark.parametrize("motions", [[0.0, 1.0], [1.0, 0.0]])
def test_among_motions_of_which_one_is_a_step_the_papers_time_stays_open(motions: list[float]) -> None:
    assert of_settling(1.2, [1.2, 1.2], motions).verdict == OPEN
    assert of_settling(1.2, [0.5, 0.5], motions).verdict == OPEN
    assert of_settling(1.2, [1.8 * (1 + HAIR), 5.0], motions).verdict == WORSE
    assert of_settling(1.2, [NEVER, NEVER], motions).verdict == WORSE


def test_after_a_step_settling_times_compare_as_any_number() -> None:
    assert of_settling(1.2, [1.2 * 1.5], [0.0]).verdict == "reproduced"
    assert of_settling(1.2, [1.8 * (1 + HAIR)], [0.0]).verdict == WORSE
    assert of_settling(1.2, [0.8 * (1 - HAIR)], [0.0]).verdict == BETTER
    assert of_settling(1.2, [NEVER], [0.0]).verdict == WORSE


@pytest.mark.parametrize(
    ("less", "more", "verdict"),
    [
        ([1.0, 1.0], [2.0, 9.0], "reproduced"),
        ([1.0, 1.0], [2.0, 1.05 * (1 + HAIR)], "reproduced"),
        ([1.0, 1.0], [2.0, 1.05 * (1 - HAIR)], OPEN),
        ([2.0, 9.0], [1.0, 1.0], FAILS),
        ([1.0, 2.0], [2.0, 1.0], OPEN),
        ([1.0, 1.0], [1.0, 1.0], OPEN),
        ([0.0], [0.0], OPEN),
        ([0.0], [1.0], "reproduced"),
        ([1.0], [0.0], FAILS),
        ([1.0], [NEVER], "reproduced"),
        ([NEVER], [1.0], FAILS),
        ([NEVER], [NEVER], OPEN),
    ],
)
def test_an_ordering_holds_on_every_motion_or_the_other_way_round(
    less: list[float], more: list[float], verdict: str
) -> None:
    assert of_ordering(less, more).verdict == verdict


def seeds(paper: float, values: list[float]) -> str:
    found = spread(np.array(values))
    return of_sample(paper, found.median, found.interval).verdict


def test_one_dead_seed_of_ten_makes_no_verdict() -> None:
    """Nine of 3e-3 to 8e-3 and one that never learnt, 0.25: a mean's interval would reach from below zero to 0.09."""
    alive = [3e-3, 3.4e-3, 4e-3, 4.1e-3, 5e-3, 5.5e-3, 6e-3, 7e-3, 8e-3]
    for paper, verdict in ((0.09, BETTER), (0.12, BETTER), (1e-4, WORSE), (5e-3, "reproduced")):
        assert seeds(paper, [*alive, 0.2467]) == verdict == seeds(paper, [*alive, 5.2e-3])
        assert seeds(paper, [*alive, NEVER]) == verdict, "nor does one that diverged"


def test_seeds_that_disagree_decide_nothing() -> None:
    assert of_sample(2.0, 2.0, (1.0, 4.0)).verdict == "open"
    assert of_sample(2.0, 2.0, (1.0, 4.0 * (1 - HAIR))).verdict == "reproduced"
    assert of_sample(2.0, 2.0, (-1.0, 4.0)).verdict == "open"
    assert of_sample(2.0, 5.0, (3.0, 12.0)).verdict == "open"
    assert of_sample(2.0, 5.0, (3.0, 11.9)).verdict == "reproduced"
    assert of_sample(2.0, 5.0, (3.0 * (1 + HAIR), 9.0)).verdict == WORSE
    assert of_sample(2.0, 1.0, (0.5, 2.0 / 1.5 * (1 - HAIR))).verdict == BETTER
    assert of_sample(2.0, NEVER, None).verdict == WORSE
    assert of_sample(2.0, 2.9, None).verdict == "reproduced" and of_sample(2.0, 3.1, None).verdict == WORSE


def test_a_fit_of_two_thirds_is_not_nearly_one() -> None:
    assert of_sample(0.95, 0.68, (0.6, 0.8), "at least").verdict == FAILS
    assert of_sample(0.95, 0.97, (0.95, 1.0), "at least").verdict == "reproduced"
    assert of_sample(0.95, 0.97, (0.95 * (1 - HAIR), 1.0), "at least").verdict == "open"
    assert of_sample(3.0, 3.0, None, "exactly").verdict == "reproduced"
    assert of_sample(3.0, 4.0, None, "exactly").verdict == FAILS


@pytest.mark.parametrize(
    ("verdicts", "one"),
    [
        (["contradicted", WORSE, WORSE], "contradicted"),
        ([FAILS, "contradicted"], "contradicted"),
        ([FAILS, WORSE], FAILS),
        ([WORSE, WORSE], WORSE),
        (["reproduced", "reproduced"], "reproduced"),
        (["reproduced", "contradicted"], OPEN),
        (["reproduced", BETTER], OPEN),
        (["contradicted", OPEN], OPEN),
        (["open", FAILS], "open"),
        (["open", "reproduced"], "open"),
        (["open", "reproduced", FAILS], OPEN),
        ([], None),
    ],
)
def test_what_fails_everywhere_is_one_verdict_and_else_what_differs_decides(
    verdicts: list[VerdictName], one: str | None
) -> None:
    assert joint(verdicts) == one == joint(verdicts[::-1])


def test_no_verdict_turns_on_the_rounding_of_a_printed_number() -> None:
    printed = Ends(1.15, 1.25)  # 1.2
    for ours, verdict in ((1.875, "reproduced"), (1.875 * (1 + HAIR), WORSE), (1.15 / 1.5 * (1 - HAIR), BETTER)):
        assert of_numbers(printed, [ours]).verdict == verdict == of_sample(printed, ours, None).verdict
    assert of_settling(printed, [1.875], [0.0]).verdict == "reproduced"
    for ours, verdict in ((1.15, "reproduced"), (1.2, OPEN), (1.25, OPEN), (1.25 * (1 + HAIR), FAILS), (NEVER, FAILS)):
        found = of_numbers(printed, [ours], "at most")
        assert found.verdict == verdict and ("rounding" in found.reason) == (verdict == OPEN)
    for ours, verdict in ((1.25, "reproduced"), (1.2, OPEN), (1.15 * (1 - HAIR), FAILS)):
        assert of_numbers(printed, [ours], "at least").verdict == verdict
    assert of_sample(printed, 1.2, (1.16, 1.24), "at most").verdict == "open"
    assert of_numbers(printed, [1.0, 2.0], "at most").reason == "holds on some motions only"
