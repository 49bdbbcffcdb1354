"""What a study says: it can come out either way, and says what it cannot tell."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.commands.ranking_tables import decision_table
from wristctl.commands.study.answer import answer_of
from wristctl.comparison.controller_ranking import undominated
from wristctl.comparison.tuned_ranking import TermValue, TunedRanking, order_shift, term_values, tuned_ranking
from wristctl.comparison.world_ranking import RANKED, RankedRow
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


RIG = {"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}}
FAMILIES = {
    "bench": Family(about="a bench"),
    "rig": Family.model_validate({"loop": RIG}),
    "chain": Family.model_validate({"loop": RIG | {"plant": {"model": "hinges"}}}),
    "jumps": Family.model_validate({"loop": RIG, "references": ({"kind": "step"},)}),
}


def ranked(*rows: RankedRow, tolerated: float = 0.0, family: str = "bench") -> TunedRanking:
    every = [row("feedforward/default", 4.0), *rows]
    return tuned_ranking(family, FAMILIES[family], [[one] for one in every], [0] * len(every), tolerated)


def told(*rankings: TunedRanking, terms: list[TermValue] | None = None) -> str:
    """The answer in one line."""
    answer = answer_of(rankings, terms or [], [])
    assert answer is not None
    lines = answer.lines()
    assert len(lines) <= 32 and max(map(len, lines)) <= 100
    return " ".join(" ".join(lines).split())


def said(*rows: RankedRow, tolerated: float = 0.0) -> str:
    return told(ranked(*rows, tolerated=tolerated))


def lost(text: str, *names: str) -> bool:
    """Whether these controllers and no others are named as those that must not be used."""
    return f"Do not use: in bench {' and '.join(names)}." in text


def test_the_better_controller_is_named_whichever_it_is() -> None:
    text = said(row("a/tuned", 1.0), row("bb/tuned", 1.5))
    assert "use a/tuned: RMSE" in text and re.search(r" bb 1\.5\b", text), "and by how much the next is worse"
    text = said(row("a/tuned", 1.5), row("bb/tuned", 1.0))
    assert "use bb/tuned: RMSE" in text and re.search(r" a 1\.5\b", text)


def test_controllers_that_cannot_be_told_apart_are_all_named() -> None:
    text = said(row("a/tuned", 1.0, 0.3), row("bb/tuned", 1.0, 0.3))
    assert re.search(r"use (a/tuned: .*\. bb|bb/tuned: .*\. a)/tuned ties with it", text)


def test_where_no_controller_beats_feedforward_that_is_told() -> None:
    text = said(row("a/tuned", 4.0, 0.3), row("bb/tuned", 4.4))
    assert re.search("No controller is better than feedforward|feedforward \\(without feedback\\) ties with it", text)


def test_what_is_told_apart_as_a_rule_is_so_when_twice_as_large_and_is_not_when_a_third() -> None:
    found = re.search(r"differ by less than ([\d.]+) %", said(row("a/tuned", 1.0, 0.2), row("bb/tuned", 1.0, 0.2)))
    assert found
    floor = float(found[1]) / 100.0
    for factor, apart in ((2.0, True), (1.0 / 3.0, False)):
        rival = ranked(row("a/tuned", 1.0, 0.2), row("bb/tuned", 1.0 + factor * floor, 0.2))
        assert (rival.standing.group(2) == 2) == apart


def test_a_controller_that_swings_is_not_recommended_unless_so_little_is_tolerated() -> None:
    text = said(row("a/tuned", 1.0, swings=1), row("bb/tuned", 1.5))
    assert "use bb/tuned" in text and lost(text, "a")
    assert "use a/tuned" in said(row("a/tuned", 1.0, swings=1), row("bb/tuned", 1.5), tolerated=0.05)


def test_a_controller_that_is_seldom_lost_keeps_its_place_until_more_is_shown() -> None:
    """1 % is tolerated: 1 of 40 does not show more, 3 do."""
    seldom, often = (said(row("a/tuned", 1.0, swings=count), row("bb/tuned", 1.5), tolerated=0.01) for count in (1, 3))
    assert "use a/tuned" in seldom and "Every controller here can be used" in seldom
    assert re.search(r"Even so it swings [\d.]+ deg peak to peak in 1 of 40 worlds\.", seldom), (
        "kept, and told all the same"
    )
    assert "use bb/tuned" in often and lost(often, "a")


def test_what_can_be_told_apart_is_one_size_or_a_range_over_conditions() -> None:
    fine, coarse = ((row("a/tuned", 1.0, spread), row("bb/tuned", 1.0, spread)) for spread in (0.02, 1.0))
    alike = told(ranked(*fine), ranked(*fine, family="rig"))
    assert re.search(r"differ by less than [\d.]+ % cannot be told apart with 95 %; more worlds can", alike)
    apart = told(ranked(*fine), ranked(*coarse, family="rig"))
    assert re.search(r"less than [\d.]+ % to [\d.]+ %, by condition, cannot be told apart", apart)


def test_two_tunings_tell_no_interval_and_the_answer_says_so() -> None:
    def tuned(*factors: float) -> str:
        rows = [[row("feedforward/default", 4.0)], [row("a/tuned", one, 0.3) for one in factors]]
        rows.append([row("bb/tuned", 1.3 * one, 0.3) for one in factors])
        return told(tuned_ranking("bench", FAMILIES["bench"], rows, [0, 0, 0]))

    both, three = tuned(1.0, 1.1), tuned(1.0, 1.1, 0.9)
    assert "Two tunings tell no interval" in both and "deg [" not in both and "cannot be told apart" not in both
    assert "Two tunings" not in three and "deg [" in three and "more worlds and tunings can" in three


def test_worlds_that_another_tuning_does_not_lose_are_told() -> None:
    def tuned(*swings: int) -> str:
        rows = [[row("feedforward/default", 4.0)], [row("a/tuned", 1.0 + k, swings=n) for k, n in enumerate(swings)]]
        rows.append([row("bb/tuned", 1.3) for _ in swings])
        return told(tuned_ranking("bench", FAMILIES["bench"], rows, [0, len(swings) - 1, 0]))

    assert "a in bench 40 of 40, with another tuning 0." in tuned(0, 40)
    assert "a in bench 3 of 40, with another tuning 30." in tuned(30, 4, 3)
    assert "another tuning" not in tuned(1, 3) and "another tuning" not in tuned(40, 40)


@pytest.mark.parametrize(("factor", "cell"), [(1.0, "bb 2"), (1e-9, "bb >")])
def test_beside_an_error_too_small_to_be_told_a_ratio_is_a_bound(factor: float, cell: str) -> None:
    (line,) = decision_table([ranked(row("a/x", factor), row("bb/x", 2.0))], {"a/x": "a", "bb/x": "bb"}).rows
    assert str(line[-1]).startswith(cell)


def test_conditions_that_no_question_parts_have_a_line_each() -> None:
    rows = row("a/x", 1.0), row("bb/x", 2.0)
    table = decision_table([ranked(*rows), ranked(*rows)], {"a/x": "a", "bb/x": "bb"})
    assert table.columns[0] == "condition" and [line[:2] for line in table.rows] == [("bench", "a")] * 2


def test_every_controller_that_must_not_be_used_is_named_and_counted_by_its_worst_fault() -> None:
    rows = [row(f"{name}/tuned", 1.0, swings=count) for name, count in (("a", 2), ("b", 7), ("d", 1))]
    found = ranked(*rows, row("e/tuned", 1.0, swings=3, failed=2), row("ff/tuned", 2.0))
    assert re.search(r"Do not use: in bench (?=[^.]*\ba\b)(?=[^.]*\bb\b)(?=[^.]*\bd\b)[^.]*\be\b[^.]*\.", told(found))
    faults = {label.split("/")[0]: found.fault(place) for place, label in enumerate(found.labels)}
    assert [fault and (fault.kind, fault.times, fault.unit) for fault in (faults["b"], faults["e"], faults["ff"])] == [
        ("swings", 7, "worlds"), ("fails", 2, "worlds"), None,
    ]  # fmt: skip


def test_what_must_not_be_used_is_told_of_each_rig() -> None:
    rows = {"rig": 2, "chain": 0}
    rigs = [ranked(row("a/x", 1.0, swings=count), row("bb/x", 2.0), family=name) for name, count in rows.items()]
    for order in (rigs, rigs[::-1]):
        assert "Do not use: in rig a." in told(*order)


def test_where_all_fail_none_is_recommended() -> None:
    text = told(tuned_ranking("bench", FAMILIES["bench"], [[row("feedforward/default", 4.0, failed=3)]], [0]))
    assert "use none of these" in text and "Do not use: in bench feedforward." in text


def test_questions_lead_to_the_controller_of_each_rig() -> None:
    """Another controller is best in each family; the order in which families come does not matter."""
    best = dict(zip(FAMILIES, ("a", "bb", "ccc", "dddd"), strict=True))
    rankings = [
        ranked(*(row(f"{name}/x", 1.0 if name == best[family] else 2.0) for name in best.values()), family=family)
        for family in FAMILIES
    ]
    for order in (rankings, rankings[::-1]):
        table = decision_table(order, {label: label.split("/")[0] for one in rankings for label in one.labels})
        assert table.columns[:3] == ("camera?", "steps?", "uneven wrist?")
        assert {tuple(line[:4]) for line in table.rows} == {
            ("no", "-", "-", "a"), ("yes", "yes", "-", "dddd"), ("yes", "no", "yes", "ccc"), ("yes", "no", "no", "bb"),
        }  # fmt: skip
        assert [line[-1].split()[-1] for line in table.rows] == ["2"] * 4


def test_a_recommendation_for_ideal_conditions_warns_of_the_rig_where_it_swings() -> None:
    rows = row("a/tuned", 1.0), row("bb/tuned", 2.0)
    swinging = row("a/tuned", 1.0, swings=5), row("bb/tuned", 2.0)
    text = told(ranked(*rows), ranked(*swinging, family="rig"))
    assert "use bb/tuned" in text and "use a/tuned" in text and "in 5 of 40 worlds" in text.split("use a/tuned", 1)[1]
    assert text.index("use bb/tuned") < text.index("use a/tuned"), "the rig comes first"


def test_what_terms_buy_is_a_line_each_and_undecided_where_the_interval_holds_one() -> None:
    found = ranked(row("a/tuned", 1.0, 0.0), row("bb/tuned", 0.5, 0.0), row("ccc/tuned", 1.0, 0.0))
    pairs = {"a term": ("a/tuned", "bb/tuned"), "a bad one": ("bb/tuned", "a/tuned"), "none": ("a/tuned", "ccc/tuned")}
    text = told(found, terms=term_values(found, pairs))
    assert "a term 2 " in text and "a bad one 0.5 " in text and "none undecided" in text


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
    before = [[row("a/tuned", 1.0)], [row("bb/tuned", 1.5)], [row("ccc/tuned", 2.0)]]
    same = order_shift(
        "the same", before, [[row(each.label, 2.0 * f)] for (each,), f in zip(before, (1.0, 1.5, 2.0), strict=True)]
    )
    assert (same.tau, same.pairs, same.resolved, same.reversed) == (1.0, 3, 3, 0) and same.ratio == pytest.approx(2.0)
    turned = order_shift(
        "turned", before, [[row(each.label, f)] for (each,), f in zip(before, (2.0, 1.5, 1.0), strict=True)]
    )
    assert (turned.tau, turned.resolved, turned.reversed) == (-1.0, 3, 3)
    assert turned.best == ("a/tuned", "ccc/tuned")
    tied = order_shift("tied", before, [[row(each.label, 1.0, 0.5)] for (each,) in before])
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


def test_the_spread_of_a_rows_tunings_is_from_the_best_to_the_worst_of_them() -> None:
    tunings = [row("pid-ff/tuned", factor, spread=0.0) for factor in (1.5, 1.0, 2.0)]
    done = tuned_ranking("bench", FAMILIES["bench"], [[row("feedforward/default", 4.0, spread=0.0)], tunings], [0, 1])
    hard = float(np.exp(np.log(HARD).mean()))
    least, most = done.spreads[1]
    assert (least, most) == pytest.approx((hard, 2.0 * hard)) and done.spreads[0] == pytest.approx((4 * hard, 4 * hard))


def test_the_table_of_tunings_counts_them_from_one_and_says_which_is_published() -> None:
    tunings = [row("pid-ff/tuned", factor, spread=0.0) for factor in (1.5, 1.0, 2.0)]
    done = tuned_ranking("bench", FAMILIES["bench"], [[row("feedforward/default", 4.0, spread=0.0)], tunings], [0, 1])
    table, hard = done.tunings_frame(), float(np.exp(np.log(HARD).mean()))
    assert table["row"].unique().tolist() == ["pid-ff/tuned"] and table["tuning"].tolist() == [1, 2, 3]
    assert table["published"].tolist() == [False, True, False] and (table["lost"] == 0).all()
    assert table["rmse"].tolist() == pytest.approx([1.5 * hard, hard, 2.0 * hard])
