"""A ranking over worlds: what is best, what is a tie, what cannot be relied on; and in real closed loops."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.comparison.world_ranking import (
    RANKED,
    RankedRow,
    WorldRanking,
    rank,
    ranking,
    ranking_frame,
    worlds_frame,
)
from wristctl.config.families import Family
from wristctl.config.load import load_study
from wristctl.simulation.cases import Measured
from wristctl.studies.rank import answer

WORLDS = 40
FAMILY = Family()


def row(label: str, rmse: Array, swings: tuple[int, ...] = (), failed: tuple[int, ...] = ()) -> RankedRow:
    lost, swung = np.isin(np.arange(WORLDS), failed), np.isin(np.arange(WORLDS), swings)
    metrics = dict.fromkeys(RANKED, rmse[None])
    nothing = np.zeros((1, WORLDS), bool)
    measured = Measured(metrics, lost[None], np.ones((1, WORLDS)), nothing[0])
    return RankedRow(label, np.where(lost, np.inf, rmse), swung, measured)


def made_up(*rows: RankedRow) -> WorldRanking:
    ordinary = np.exp(np.random.default_rng(0).normal(-3.0, 0.5, WORLDS))
    return ranking("made-up", FAMILY, [row("feedforward/default", ordinary), *rows], 0)


def hard(seed: int = 0, scale: float = 1.0, spread: float = 0.05) -> Array:
    """RMSE that is much the same share of feedforward's in all worlds."""
    ordinary = np.exp(np.random.default_rng(0).normal(-3.0, 0.5, WORLDS))
    return ordinary * scale * np.exp(np.random.default_rng(seed).normal(0.0, spread, WORLDS))


def test_rows_that_worlds_cannot_tell_apart_are_one_group_and_others_are_not() -> None:
    found = made_up(row("a/x", hard(1, 0.3)), row("b/x", hard(2, 0.301)), row("c/x", hard(3, 0.5)))
    names = [[found.rows[at].label for at in group.rows] for group in found.standing.groups]
    assert [set(each) for each in names] == [{"a/x", "b/x"}, {"c/x"}, {"feedforward/default"}]
    gain = found.gains[found.standing.groups[0].rows[0]]
    assert gain.low < 1.0 / 0.3 < gain.high and gain.low > 3.0
    said = answer(found)
    assert "a/x, b/x (a tie) are best" in said or "b/x, a/x (a tie) are best" in said
    assert "Next is c/x" in said and "cannot be told in 40 worlds" in said and "Not to be relied on" not in said


def test_a_law_that_is_best_until_it_swings_is_never_called_best() -> None:
    found = made_up(row("wild/x", hard(1, 0.01), swings=(7,)), row("calm/x", hard(2, 0.5)))
    assert found.rows[found.standing.groups[0].rows[0]].label == "calm/x"
    assert found.group(1) is None and found.order[-1] == 1
    assert "calm/x is best" in answer(found) and "wild/x (swings in 1 of 40)" in answer(found)


def test_a_law_that_fails_anywhere_is_kept_and_never_called_best() -> None:
    found = made_up(row("wild/x", hard(1, 0.01), failed=(3, 4)), row("calm/x", hard(2, 0.5)))
    assert "wild/x (fails in 2 of 40)" in answer(found) and found.rows[found.order[0]].label == "calm/x"
    lines = {line["row"]: line for line in ranking_frame(found).to_dict("records")}
    assert lines["wild/x"]["failures"] == 0.05 and lines["wild/x"]["worst_rmse"] == np.inf
    assert found.group(1) is None and lines["calm/x"]["group"] == 1


def test_where_everything_swings_nothing_is_best() -> None:
    found = ranking("made-up", FAMILY, [row("feedforward/default", hard(), swings=(0,))], 0)
    assert answer(found) == ("On made-up nothing can be relied on: every row fails or swings in some of 40 worlds.")


SETTINGS = (
    "families={soft: {loop: {control_period: 5e-3}, draw: {plant.stiffness: x0.6..1.4, reference.angle_deg: 10..40},"
    " references: [{duration: 0.3}, {duration: 0.5}], horizon: 2.6}}",
    "compare.worlds={family: soft, draws: 10}",
    "compare.rows=[{controller: ct-dob}, {controller: computed-torque},"
    " {controller: smc, gains: exchanged}]",
)  # fmt: skip


def test_in_real_loops_an_observer_beats_none_and_what_is_too_fast_swings_or_fails() -> None:
    study = load_study([], list(SETTINGS))
    found = rank(study)
    labels = [found.rows[at].label for at in found.order]
    assert labels[:3] == ["ct-dob/default", "computed-torque/default", "feedforward/default"]
    assert found.group(found.order[3]) is None
    assert found.gains[found.order[0]].low > 3.0
    worlds = worlds_frame(found)
    own = worlds[worlds["row"] == "ct-dob/default"]
    score = np.exp(np.log(own["rmse"]).groupby(own["world"]).mean())
    assert found.means[0].value == pytest.approx(np.exp(np.log(score).mean())) and len(own) == 20


def test_the_same_worlds_give_the_same_ranking_whatever_stands_beside_a_row() -> None:
    study = load_study([], list(SETTINGS))
    alone = load_study([], [*SETTINGS, "compare.rows=[{controller: computed-torque}]"])
    ours = [next(r for r in rank(each).rows if r.label == "computed-torque/default") for each in (study, alone)]
    assert np.array_equal(ours[0].rmse, ours[1].rmse)
