"""What a study says: it can come out either way, and says what it cannot tell."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from wristctl.arrays import Array
from wristctl.commands.study.answer import answer
from wristctl.commands.study.figures import undominated
from wristctl.comparison.paired_worlds import order_shift, term_values
from wristctl.comparison.world_ranking import RANKED, RankedRow, WorldRanking, ranking
from wristctl.config.families import Family
from wristctl.simulation.cases import Measured

WORLDS = 40
HARD = np.exp(np.random.default_rng(1).normal(-5.0, 0.4, WORLDS))
"""How hard each world is."""


def row(
    label: str, factor: float, spread: float = 0.02, swings: int = 0, failed: int = 0, quiet: float = 1.0
) -> RankedRow:
    """A row that is so many times worse than another in every world, give or take."""
    noise = np.random.default_rng(len(label)).normal(0.0, spread, WORLDS)
    rmse = HARD * factor * np.exp(noise - noise.mean())
    rmse[:failed] = np.inf
    metrics = {name: np.full((1, WORLDS), quiet) for name in RANKED} | {
        "rmse": rmse[None],
        "drift": np.zeros((1, WORLDS)),
    }
    ones = np.ones((1, WORLDS))
    measured = Measured(metrics, np.isinf(rmse)[None], ones, np.ones(WORLDS, bool))
    return RankedRow(label, rmse, np.arange(WORLDS) < swings, measured)


def ranked(*rows: RankedRow, tolerated: float = 0.0) -> WorldRanking:
    every = [row("feedforward/default", 4.0), *rows]
    return ranking("bench", Family(about="a bench"), every, 0, tolerated)


def said(*rows: RankedRow, tolerated: float = 0.0) -> str:
    return " ".join(answer({"bench": ranked(*rows, tolerated=tolerated)}, [], []))


def test_the_better_law_is_named_whichever_it_is() -> None:
    assert "run a/tuned: RMSE" in said(row("a/tuned", 1.0), row("bb/tuned", 1.5))
    text = said(row("a/tuned", 1.5), row("bb/tuned", 1.0))
    assert "run bb/tuned: RMSE" in text and "Told apart, the nearest: a/tuned" in text


def test_laws_that_cannot_be_told_apart_are_named_with_their_errors_and_which_is_quieter() -> None:
    text = said(row("a/tuned", 1.0, 0.3, quiet=5.0), row("bb/tuned", 1.0, 0.3, quiet=2.0))
    assert re.search(r"Not told apart from it: (a|bb)/tuned [\d.]+\.", text)
    assert "Of all these bb/tuned moves the tendons least." in text


def test_where_no_law_beats_feedforward_that_is_said() -> None:
    text = said(row("a/tuned", 4.0, 0.3), row("bb/tuned", 4.4))
    assert "run feedforward, " in text and "no law is told apart from it for the better" in text


def test_what_is_told_apart_as_a_rule_is_so_when_twice_as_large_and_is_not_when_a_third() -> None:
    found = re.search(r"differences of ([\d.]+) % or more", said(row("a/tuned", 1.0, 0.2), row("bb/tuned", 1.0, 0.2)))
    assert found
    floor = float(found[1]) / 100.0
    for factor, told in ((2.0, "Told apart, the nearest: bb/tuned"), (1.0 / 3.0, "Not told apart from it: bb/tuned")):
        assert told in said(row("a/tuned", 1.0, 0.2), row("bb/tuned", 1.0 + factor * floor, 0.2))


def test_how_many_swings_none_in_so_many_worlds_leaves_possible_is_said() -> None:
    """0 of n: the upper end of a two-sided 95 % interval for a share, 3.7/n or a little less."""
    found = re.search(r"though none in 40 can be ([\d.]+) %", said(row("a/tuned", 1.0), row("bb/tuned", 1.0, swings=9)))
    exact = 100.0 * binomtest(0, WORLDS).proportion_ci(0.95).high
    assert found and float(found[1]) == pytest.approx(exact, rel=0.05)


def test_what_the_papers_law_comes_to_is_said() -> None:
    assert "The paper's law, tuned: " in said(row("a/tuned", 1.0), row("smc/tuned", 3.0))
    assert ", 3 times the lowest." in said(row("a/tuned", 1.0, 0.0), row("smc/tuned", 3.0, 0.0))
    assert "The paper's law" not in said(row("smc/tuned", 1.0), row("a/tuned", 3.0)), "where it is the lowest itself"


def test_a_law_that_swings_is_not_recommended_unless_so_little_is_tolerated() -> None:
    text = said(row("a/tuned", 1.0, swings=1), row("bb/tuned", 1.5))
    assert "run bb/tuned" in text and "Worlds lost, of 40: 1 in a/tuned." in text
    assert "run a/tuned" in said(row("a/tuned", 1.0, swings=1), row("bb/tuned", 1.5), tolerated=0.05)


def test_a_law_that_is_seldom_lost_is_told_with_its_share_and_loses_its_place_where_that_is_shown_to_be_more() -> None:
    """1 % is tolerated: 1 of 40 does not show more, 3 do."""
    seldom, often = (said(row("a/tuned", 1.0, swings=count), row("bb/tuned", 1.5), tolerated=0.01) for count in (1, 3))
    assert "run a/tuned" in seldom and "a/tuned in 2.5 % [0.063, 13]" in seldom and "Worlds lost" not in seldom
    assert "run bb/tuned" in often and "Worlds lost, of 40: 3 in a/tuned." in often and "is tolerated: " not in often


def test_every_law_that_is_lost_is_named_the_worst_first() -> None:
    rows = [row(f"{name}/tuned", 1.0, swings=count) for name, count in (("a", 2), ("b", 7), ("c", 2), ("d", 1))]
    text = said(*rows, row("e/tuned", 1.0, swings=3, failed=2), row("ff/tuned", 2.0))
    assert "Worlds lost, of 40: 7 in b/tuned; 3 in e/tuned; 2 in a/tuned, c/tuned; 1 in d/tuned." in text


def test_where_all_fail_none_is_recommended() -> None:
    found = ranking("bench", Family(about="a bench"), [row("feedforward/default", 4.0, failed=3)], 0)
    assert "run none of these" in answer({"bench": found}, [], [])[0]


@pytest.mark.parametrize(
    ("factor", "told"), [(0.5, "2 [2, 2]"), (2.0, "worse 0.5 [0.5, 0.5]"), (1.0, "undecided 1.000 [1.000, 1.000]")]
)
def test_a_term_buys_the_ratio_of_the_errors_with_and_without_it(factor: float, told: str) -> None:
    found = ranked(row("a/tuned", 1.0, 0.0), row("bb/tuned", factor, 0.0, swings=3, failed=1))
    (value,) = term_values(found, {"a term": ("a/tuned", "bb/tuned"), "another": ("a/tuned", "missing")})
    sound = ranked(row("a/tuned", 1.0, 0.0), row("bb/tuned", factor, 0.0))
    (exact,) = term_values(sound, {"a term": ("a/tuned", "bb/tuned")})
    assert exact.times.value == pytest.approx(1.0 / factor) and exact.told == told
    assert value.swings == (0, 3) and value.told.endswith(", lost 0 -> 3"), "worlds, each once"


def test_an_order_that_stays_and_one_that_turns_round() -> None:
    before = [row("a/tuned", 1.0), row("bb/tuned", 1.5), row("ccc/tuned", 2.0)]
    same = order_shift(
        "the same", before, [row(each.label, 2.0 * f) for each, f in zip(before, (1.0, 1.5, 2.0), strict=True)]
    )
    assert (same.tau, same.pairs, same.resolved, same.reversed) == (1.0, 3, 3, 0) and same.ratio == pytest.approx(2.0)
    turned = order_shift(
        "turned", before, [row(each.label, f) for each, f in zip(before, (2.0, 1.5, 1.0), strict=True)]
    )
    assert (turned.tau, turned.resolved, turned.reversed) == (-1.0, 3, 3)
    assert turned.best == ("a/tuned", "ccc/tuned")
    tied = order_shift("tied", before, [row(each.label, 1.0, 0.5) for each in before])
    assert tied.resolved == 0 and tied.reversed == 0


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=1, max_size=9))
def test_what_is_undominated_is_beaten_by_nobody_in_all(costs: list[tuple[int, int]]) -> None:
    found = undominated(np.array(costs, float))
    for own, each in zip(found, costs, strict=True):
        beaten = any(a <= each[0] and b <= each[1] and (a, b) != each for a, b in costs)
        assert own == (not beaten)


def test_what_has_no_cost_is_not_on_the_front() -> None:
    costs: Array = np.array([[1.0, np.nan], [2.0, 2.0]])
    assert undominated(costs).tolist() == [False, True]
