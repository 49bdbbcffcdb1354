"""A ranking over worlds: what is best, what is a tie, what cannot be relied on; and in real closed loops."""

from __future__ import annotations

import re

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.commands.compare.answer import answer_of
from wristctl.commands.compare.command import Compared
from wristctl.commands.results import Findings
from wristctl.comparison.model_confidence_set import LEAST_PAIRS
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
from wristctl.config.loop import Reference
from wristctl.simulation.cases import Measured
from wristctl.study_files.load import load_study

WORLDS = 40
FAMILY = Family()


def row(label: str, rmse: Array, swings: tuple[int, ...] = (), failed: tuple[int, ...] = ()) -> RankedRow:
    worlds = np.arange(len(rmse))
    lost, swung = np.isin(worlds, failed), np.isin(worlds, swings)
    none = np.zeros((1, len(worlds)))
    metrics = dict.fromkeys(RANKED, rmse[None]) | {"drift": none}
    measured = Measured(metrics, lost[None], none + 1.0, none[0] > 0.0)
    return RankedRow(label, np.where(lost, np.inf, rmse), swung, measured)


def made_up(*rows: RankedRow) -> WorldRanking:
    ordinary = np.exp(np.random.default_rng(0).normal(-3.0, 0.5, WORLDS))
    return ranking("made-up", FAMILY, [row("feedforward/default", ordinary), *rows])


def told(*rankings: WorldRanking) -> str:
    """The answer of rankings, in one line."""
    answer = answer_of(rankings)
    assert answer is not None
    return " ".join(" ".join(answer.lines()).split())


def hard(seed: int = 0, scale: float = 1.0, spread: float = 0.05) -> Array:
    """RMSE that is much the same share of feedforward's in all worlds."""
    ordinary = np.exp(np.random.default_rng(0).normal(-3.0, 0.5, WORLDS))
    return ordinary * scale * np.exp(np.random.default_rng(seed).normal(0.0, spread, WORLDS))


def test_overlapping_intervals_of_rows_that_are_told_apart_are_explained_and_others_not() -> None:
    """Worlds differ by far more than rows in one world do: which row errs less is plain in pairs alone."""
    alike = made_up(row("a/x", hard(1, 0.3, 0.01)), row("b/x", hard(2, 0.32, 0.01)))
    first, second = alike.standing.groups[0][0], alike.standing.groups[1][0]
    assert alike.means[second].low < alike.means[first].high and "in pairs on the same worlds" in told(alike)
    tied = made_up(row("a/x", hard(1, 0.1, 0.01)), row("b/x", hard(2, 0.1, 0.01)))
    far = made_up(row("a/x", hard(1, 0.1, 0.01)), row("b/x", hard(2, 0.4, 0.01)))
    for other in (tied, far):
        assert "in pairs" not in told(other)


def test_rows_that_worlds_cannot_tell_apart_are_one_group_and_others_are_not() -> None:
    found = made_up(row("a/x", hard(1, 0.3)), row("b/x", hard(2, 0.301)), row("c/x", hard(3, 0.5)))
    names = [[found.rows[at].label for at in group] for group in found.standing.groups]
    assert [set(each) for each in names] == [{"a/x", "b/x"}, {"c/x"}, {"feedforward/default"}]
    gain = found.gains[found.standing.groups[0][0]]
    assert gain.low < 1.0 / 0.3 < gain.high and gain.low > 3.0
    said = told(found)
    assert re.search(r"use (a/x: .*\. b|b/x: .*\. a)/x ties with it", said)
    assert re.search(r" a [^*=]*\* b [^*=]*= c [\d.]+ \[[^=*]*\] Every controller", said), "a line each"
    assert "Every controller here can be used" in said


def test_a_law_that_is_best_until_it_swings_is_never_called_best() -> None:
    found = made_up(row("wild/x", hard(1, 0.01), swings=(7, 8, 9)), row("calm/x", hard(2, 0.5)))
    assert found.rows[found.standing.groups[0][0]].label == "calm/x"
    assert found.standing.group(1) is None and found.standing.order[-1] == 1
    said = told(found)
    assert "use calm/x" in said and "wild" not in said.partition("RMSE [deg]")[0] and "wild swings in 3 of 40 " in said
    assert "Do not use: in made-up wild." in said


def test_a_law_that_fails_anywhere_is_kept_and_never_called_best() -> None:
    found = made_up(row("wild/x", hard(1, 0.01), failed=(3, 4, 5)), row("calm/x", hard(2, 0.5)))
    assert "wild fails in 3 of 40 " in told(found) and "use calm/x" in told(found)
    assert found.rows[found.standing.order[0]].label == "calm/x"
    lines = {line["row"]: line for line in ranking_frame(found).to_dict("records")}
    assert lines["wild/x"]["failures"] == 0.075 and lines["wild/x"]["worst_rmse"] == np.inf
    assert found.standing.group(1) is None and lines["calm/x"]["group"] == 1


def test_where_everything_swings_nothing_is_best() -> None:
    found = ranking("made-up", FAMILY, [row("feedforward/default", hard(), swings=(0, 1, 2))])
    assert "use none of these" in told(found)


SETTINGS = (
    "families={soft: {loop: {control_period: 5e-3}, draw: {plant.stiffness: x0.6..1.4, reference.angle_deg: 10..40},"
    " references: [{duration: 0.3}, {duration: 0.5}], horizon: 2.6}}",
    "compare.worlds={family: soft, draws: 10}",
    "compare.controllers=[{controller: ct-dob}, {controller: computed-torque},"
    " {controller: smc, gains: exchanged}]",
)  # fmt: skip


def test_in_real_loops_an_observer_beats_none_and_what_is_too_fast_swings_or_fails() -> None:
    study = load_study([], list(SETTINGS))
    (found,) = rank(study)
    labels = [found.rows[at].label for at in found.standing.order]
    assert labels[:3] == ["ct-dob/default", "computed-torque/default", "feedforward/default"]
    assert found.standing.group(found.standing.order[3]) is None
    assert found.gains[found.standing.order[0]].low > 3.0
    worlds = worlds_frame(found)
    own = worlds[worlds["row"] == "ct-dob/default"]
    for world in range(10):
        rmse = own["rmse"][own["world"] == world]
        assert found.rows[0].rmse[world] == pytest.approx(np.exp(np.log(rmse).mean()), rel=1e-12)
    assert found.means[0].value == pytest.approx(np.exp(np.log(found.rows[0].rmse).mean()))
    assert sorted(zip(own["world"], own["motion"], strict=True)) == [(w, m) for w in range(10) for m in (0, 1)]


def test_a_row_that_chatters_in_a_world_stands_with_those_that_swing_and_is_named_so() -> None:
    """Wrists of 120 mm of all springs, three worlds."""
    study = load_study([], [
        "families={long: {draw: {plant.stiffness: x0.9..1.1}, references: [{duration: 0.5}], horizon: 2.6}}",
        "wrist.length=0.12", "compare.worlds={family: long, draws: 3}",
        "compare.controllers=[{controller: super-twisting}, {controller: ct-dob, gains: hardware}]",
    ])  # fmt: skip
    (found,) = rank(study)
    slams, sound = found.labels.index("super-twisting/default"), found.labels.index("ct-dob/hardware")
    assert found.rows[slams].swings.all() and not found.rows[sound].swings.any()
    assert found.standing.fate(slams) == "unreliable" and 300.0 < found.chatter[slams] < 600.0
    assert found.unsound["chatters"][[slams, sound]].tolist() == [3, 0] and found.chatter[sound] == 0.0
    assert re.search(r"super-twisting/default chatters \d+/s in 3 of 3 ", told(found))


def test_the_table_of_worlds_has_each_row_world_and_motion_in_its_place() -> None:
    """Errors that are 10^-(3 + world) and three times as much in the second motion."""
    motions = np.array([1.0, 3.0])
    family = Family(references=(Reference(), Reference(duration=2.0)))
    rows = []
    for factor, label in ((1.0, "feedforward/default"), (0.5, "a/x")):
        rmse = (factor * 10.0 ** -(3.0 + np.arange(4.0))[:, None] * motions).reshape(1, -1)
        metrics = dict.fromkeys(RANKED, rmse) | {"drift": np.zeros((1, 8))}
        failed = np.zeros((1, 8), bool)
        failed[0, 5] = label == "a/x"
        measured = Measured(metrics, failed, np.ones((1, 8)), np.zeros(8, bool))
        scores = np.sqrt(3.0) * factor * 10.0 ** -(3.0 + np.arange(4.0))
        rows.append(RankedRow(label, scores, np.zeros(4, bool), measured))
    found = worlds_frame(ranking("made-up", family, rows))
    for line in found.to_dict("records"):
        factor = 0.5 if line["row"] == "a/x" else 1.0
        assert line["rmse"] == pytest.approx(factor * 10.0 ** -(3.0 + line["world"]) * motions[line["motion"]])
        assert line["failed"] == (line["row"] == "a/x" and line["world"] == 2 and line["motion"] == 1)
    assert len(found) == 16 and len({(a, b, c) for a, b, c in found[["row", "world", "motion"]].to_numpy()}) == 16


def test_steps_are_ranked_apart_from_smooth_motions() -> None:
    """A law that fails and swings on steps alone keeps its place among smooth motions."""
    settings = [
        "families={mixed: {references: [{kind: step}, {duration: 0.5}, {duration: 0.4}], horizon: 1.6,"
        " draw: {plant.stiffness: x0.9..1.1, reference.angle_deg: 10..30}}}",
        "compare.worlds={family: mixed, draws: 8}",
        "compare.controllers=[{controller: ct-dob}]",
    ]
    smooth, steps = rank(load_study([], settings))
    assert (smooth.name, smooth.jumps, smooth.motions) == ("mixed", False, 2)
    assert (steps.name, steps.jumps, steps.motions) == ("mixed, steps", True, 1)
    assert sorted(set(worlds_frame(smooth)["motion"])) == [1, 2] and set(worlds_frame(steps)["motion"]) == {0}
    for found in (smooth, steps):
        own = worlds_frame(found)
        for at, row in enumerate(found.rows):
            scores = own[own["row"] == row.label].groupby("world")["rmse"].apply(lambda x: np.exp(np.log(x).mean()))
            assert found.rows[at].rmse == pytest.approx(scores.to_numpy(), rel=1e-12)
    assert steps.rows[0].rmse.min() > 10.0 * smooth.rows[0].rmse.max()
    alone = load_study([], [*settings, "families.mixed.references=[{kind: step}]"])
    assert [each.name for each in rank(alone)] == ["mixed"]


def test_a_family_of_too_few_worlds_tells_so_and_ranks_nothing() -> None:
    def few(label: str, scale: float) -> RankedRow:
        return row(label, scale * np.ones(3))

    found = ranking("made-up", FAMILY, [few("feedforward/default", 1.0), few("a/x", 0.01)])
    said = told(found)
    assert f"(3 worlds, {LEAST_PAIRS} are needed)" in said and "no ranking" in said and " use " not in said
    assert [line["fate"] for line in ranking_frame(found).to_dict("records")] == ["too few to tell"] * 2


def test_a_comparison_has_a_fault_where_all_rows_are_unreliable_and_none_where_worlds_are_few() -> None:
    study = load_study([], [])

    def fault(swings: tuple[int, ...], worlds: int = WORLDS) -> bool:
        rows = [row(label, hard(seed)[:worlds], swings) for seed, label in enumerate(("feedforward/default", "a/x"))]
        found = ranking("made-up", FAMILY, rows)
        return Compared(study, Findings(0), [], [], {}, {}, [found]).fault is not None

    assert fault((0, 1, 2)) and not fault(()) and not fault((), worlds=3) and fault((0, 1), worlds=3)


def test_a_law_that_is_seldom_lost_keeps_its_place_and_is_told_with_its_share() -> None:
    rows = [row("feedforward/default", hard()), row("a/x", hard(1, 0.1), swings=(3,))]
    kept, gone = ranking("made-up", FAMILY, rows), ranking("made-up", FAMILY, rows, tolerated=0.0)
    assert kept.standing.groups[0] == [1] and gone.standing.unreliable == [1]
    assert "use a/x" in told(kept) and "use feedforward" in told(gone) and "1 of 40 worlds" in told(kept)
    lines = {line["row"]: line for line in ranking_frame(kept).to_dict("records")}
    assert (lines["a/x"]["lost"], lines["a/x"]["fate"]) == (1 / 40, "ranked")
    assert lines["a/x"]["lost_low"] < 0.01 < lines["a/x"]["lost_high"]


def test_errors_that_nobody_can_measure_are_said_to_be_less() -> None:
    said = told(made_up(row("a/x", np.full(WORLDS, 1e-9)), row("b/x", np.full(WORLDS, 1e-6))))
    assert re.search(r"use a/x: RMSE <0.001 deg, .*\. b/x ties with it", said)


def test_the_same_worlds_give_the_same_ranking_whatever_stands_beside_a_row() -> None:
    study = load_study([], list(SETTINGS))
    alone = load_study([], [*SETTINGS, "compare.controllers=[{controller: computed-torque}]"])
    ours = [next(r for r in rank(each)[0].rows if r.label == "computed-torque/default") for each in (study, alone)]
    assert np.array_equal(ours[0].rmse, ours[1].rmse)
