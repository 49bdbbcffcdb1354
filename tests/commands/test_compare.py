"""What a comparison says of its rows: tables beside the paper, metrics with intervals, which figures."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import repeated
from wristctl.commands.compare.command import COMPARE, Compared
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import check_row, with_what_there_is
from wristctl.commands.printed_table import Table
from wristctl.comparison import combinations, step_cost
from wristctl.comparison.bootstrap import FEWEST_WORLDS
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import traits_of
from wristctl.comparison.repetition_spread import spread
from wristctl.comparison.step_cost import StepTime
from wristctl.control.pid import PID
from wristctl.control.smc import SMC
from wristctl.errors import UserError
from wristctl.records.manifest import read_overview
from wristctl.simulation.metrics import METRICS

MOVE, STEP = "minimum jerk 1 s 30 deg", "step 30 deg"
REFERENCES = "references: [{kind: step}, {kind: minimum-jerk}, {kind: minimum-jerk, duration: 2.0}]"
ROWS = "controllers: [{controller: pid, gains: printed}, {controller: feedforward}]"
Compare = Callable[..., Compared]


def row(loop: str, reference: str, label: str, inverse: str = "closed-form", **how: Any) -> ComparedRow:
    controller, gains = label.split("/")
    return ComparedRow(
        loop, reference, inverse, controller, gains, repeated(label, **how), reference.startswith("step")
    )


def both(loop: str, reference: str, **how: Any) -> list[ComparedRow]:
    return [row(loop, reference, label, **how) for label in ("pid/printed", "feedforward/default")]


@pytest.fixture
def compare(monkeypatch: pytest.MonkeyPatch) -> Compare:
    """A comparison that came out with these rows; a control step takes 1, 2, ... us, at worst ten times as long."""

    def compared(rows: list[ComparedRow], loops: str = "{fast: {}}", inverses: str = "[closed-form]") -> Compared:
        monkeypatch.setattr(combinations, "compare", lambda *_: rows)
        times = iter(range(1, 10))
        monkeypatch.setattr(step_cost, "step_time", lambda *_: StepTime((at := float(next(times))), 10.0 * at))
        return wristctl.compare(
            wristctl.load_study(None, f"compare={{loops: {loops}, inverses: {inverses}, {REFERENCES}, {ROWS}}}")
        )

    return compared


def after_the_answer(done: Compared) -> list[Table]:
    """The tables of loops and what follows: all but the answer's own."""
    first = next(place for place, table in enumerate(done.tables) if table.title.startswith("Loop"))
    assert first in (1, 2), "the answer's tables come first"
    return list(done.tables[first:])


def test_each_loop_and_reference_has_a_table_with_a_row_for_each_controller(compare: Compare) -> None:
    rows = [each for loop in ("fast", "slow") for reference in (STEP, MOVE) for each in both(loop, reference)]
    done = compare(rows, "{fast: {}, slow: {}}")
    titles = [f"Loop {loop}, {reference}" for loop in ("fast", "slow") for reference in (STEP, MOVE)]
    assert [table.title for table in after_the_answer(done)] == [*titles, "Control step of one wrist on this machine"]
    assert [[line[:2] for line in table.rows] for table in after_the_answer(done)[:-1]] == [
        [("pid/printed", "closed-form"), ("feedforward/default", "closed-form")]
    ] * 4
    assert done.tables[-1].rows == [("pid/printed", 1.0, 10.0), ("feedforward/default", 2.0, 20.0)]
    assert done.tables[-1].columns == ("controller", "median [us]", "p99 [us]")


def test_a_row_shows_every_metric_that_has_a_heading_below_it_and_the_papers_numbers(compare: Compare) -> None:
    known = {name: 0.1 * k for k, name in enumerate(METRICS) if name != "rmse"} | {"rmse": 1e-3}
    others: dict[str, Any] = {name: value for name, value in known.items() if name != "rmse"}
    (table, _) = after_the_answer(
        compare([row("fast", STEP, "pid/printed", **others), row("fast", STEP, "feedforward/default")])
    )
    first = dict(zip(table.columns, table.rows[0], strict=True))
    headed = {metric.heading: name for name, metric in METRICS.items() if metric.heading}
    assert list(table.columns[:4]) == ["controller", "inverse", METRICS["rmse"].heading, METRICS["settling"].heading]
    assert set(headed) == set(table.columns) - {"controller", "inverse", "paper's", "verdict", "fate"}
    for heading, name in headed.items():
        assert first[heading] == known[name]
    assert first["paper's"] == "0.0015 / 3 / 0.00248" and first["verdict"] == "not reproduced"
    assert table.rows[1][-3:] == ("", "", ""), "the paper has none"


def test_a_row_as_good_as_the_papers_is_reproduced(compare: Compare) -> None:
    done = compare([row("fast", STEP, "pid/printed", rmse=[1.5e-3], settling=3.0, steady_state=2e-3)])
    assert after_the_answer(done)[0].rows[0][-2:] == ("reproduced", "")


@pytest.mark.parametrize(("failed", "said"), [(0, "never"), (1, "failed")])
def test_what_never_settles_says_so_or_that_it_failed(compare: Compare, failed: int, said: str) -> None:
    (table, _) = after_the_answer(compare([row("fast", STEP, "pid/printed", failed=failed, settling=np.nan)]))
    shown = dict(zip(table.columns, table.rows[0], strict=True))
    assert shown[METRICS["settling"].heading] == said
    assert shown["fate"] == ("FAILED: left its range at 0.5 s" if failed else "")


def test_a_row_that_swings_at_rest_is_told_to(compare: Compare) -> None:
    rows = [row("fast", STEP, f"pid/{size}", oscillation=math.radians(size)) for size in (0.09, 0.12)]
    (table, _) = after_the_answer(compare(rows))
    assert [each[-1][:21] for each in table.rows] == ["", "LIMIT CYCLE: +-0.12 d"]


def test_of_repetitions_medians_are_shown_with_the_interval_of_the_rmse(compare: Compare) -> None:
    rmse = [float(k) for k in range(1, 10)]
    done = compare(both("fast", STEP, rmse=rmse, settling=2.0))
    table = after_the_answer(done)[0]
    assert table.title == f"Loop fast, {STEP}, medians of 9 repetitions"
    at = list(table.columns).index("RMSE's 95 % low")
    assert table.columns[at : at + 4] == ("RMSE's 95 % low", "high", "paper's", "verdict")
    expected = spread(np.array(rmse))
    assert table.rows[0][at : at + 2] == (expected.low, expected.high) and table.rows[0][2:4] == (5.0, 2.0)
    metric = done.findings.metrics[f"rmse_fast_pid/printed_closed-form_{STEP.replace(' ', '-')}"]
    assert (metric["value"], metric["n"], metric["interval"]) == (5.0, 9, (expected.low, expected.high))
    assert (metric["unit"], metric["better"]) == ("rad", "lower")


def test_the_answer_is_drawn_and_each_class_by_itself(compare: Compare) -> None:
    rows = [*both("fast", STEP), *both("fast", MOVE), *both("fast", MOVE, inverse="none")]
    done = compare(rows, inverses="[closed-form, none]")
    assert list(done.figures) == [
        "answer", "performance-profile", "ratio-to-feedforward", "probability-sampled", "overlay-sampled",
        "error-over-time-sampled",
        "tension-over-time-sampled", "rmse-against-tension-variation", "rmse-by-reference-fast",
        "tension-variation-fast",
    ]  # fmt: skip
    names = [label.get_text() for label in done.figures["rmse-by-reference-fast"].axes[0].get_yticklabels()]
    ways = ("closed-form", "none")
    assert names == [f"{label}, {way}" for way in ways for label in ("pid/printed", "feedforward/default")]
    errors = done.figures["error-over-time-sampled"].axes[0]
    assert errors.get_title("left") == f"sampled: loop fast, {MOVE}", "a move sooner than a step"
    assert errors.get_yscale() == "log" and len(errors.lines) == 2, "several controllers on one axis"
    assert done.findings.overview.figure == "answer" and list(done.findings.overview.captions) == list(done.figures)


def test_where_all_references_are_steps_the_first_of_them_is_drawn(compare: Compare) -> None:
    done = compare([*both("fast", STEP), *both("fast", "step 5 deg")])
    drawn = done.figures["error-over-time-sampled-steps"].axes[0]
    assert drawn.get_title("left") == f"sampled (steps): loop fast, {STEP}"


def test_loops_stand_beside_each_other_for_each_reference(compare: Compare) -> None:
    rows = [each for loop in ("a", "b") for reference in (STEP, MOVE) for each in both(loop, reference)]
    done = compare(rows, "{a: {}, b: {plant: {payload: 0.1}}}")
    made = done.figures["rmse-by-loop-minimum-jerk-1-s-30-deg"]
    assert [label.get_text() for label in made.axes[0].get_xticklabels()] == ["a", "b"]
    assert len(made.axes) == 2, "the paper has no such loops"
    assert "error-over-time-off-nominal" in done.figures


def test_a_run_draws_the_answer_with_an_overlay_of_each_condition_and_says_what_else_there_is(
    compare: Compare, tmp_path: Path
) -> None:
    rows = both("fast", MOVE)
    done = compare(rows)
    with pytest.MonkeyPatch.context() as during:
        during.setattr(combinations, "compare", lambda *_: rows)
        kept = wristctl.compare(done.study, out=tmp_path)
    assert kept.run is not None
    assert {file.stem for file in (kept.run.path / "figures").iterdir()} == {"answer", "overlay-sampled"}
    overview = read_overview(kept.run.path)
    assert overview.answer == list(kept.summary) and "tension-variation-fast" in overview.captions
    assert (kept.run.path / "README.md").read_text().index(kept.summary[1]) < 700, "the page begins with it"


def test_the_papers_columns_stand_where_its_numbers_can_be_meant_and_a_sine_never_settles(compare: Compare) -> None:
    sine = "sine 0.5 Hz 30 deg"
    rows = [each for loop in ("a", "b") for reference in (MOVE, sine) for each in both(loop, reference)]
    time = rows[0].simulation.trajectory.time
    for at, each in enumerate(rows):
        if each.reference == sine:
            moving = dataclasses.replace(each.simulation.trajectory, theta_ref=np.sin(time))
            done = dataclasses.replace(each.simulation, trajectory=moving)
            rows[at] = dataclasses.replace(each, repeated=dataclasses.replace(each.repeated, first=done))
    told = compare(rows, "{a: {}, b: {sensor: {level: camera}}}")
    for table in after_the_answer(told)[:4]:
        papers = table.title == f"Loop a, {MOVE}"
        assert ("paper's" in table.columns) == papers == ("verdict" in table.columns)
        assert (METRICS["settling"].heading in table.columns) == ("sine" not in table.title)


def test_a_plan_counts_rollouts_and_names_the_row_that_cannot_be() -> None:
    two = "horizon: 2.5, loops: {a: {}, b: {}}, inverses: [none]"
    study = wristctl.load_study(None, f"compare={{{two}, {ROWS}}}")
    references = len(study.compare.references)
    assert COMPARE.plan(study, Inputs()) == f"{2 * 2 * references} rollouts of 2.5 s"
    tuned: Any = SimpleNamespace(study=study, gains={"smc": SMC.presets["exchanged"]}, run=None)
    wrong = wristctl.load_study(
        None, "compare.controllers=[{controller: feedforward}, {controller: pid, gains: tuned}]"
    )
    with pytest.raises(UserError) as caught:
        COMPARE.plan(wrong, Inputs({"tuned": tuned}))
    assert caught.value.what == "no tuned gains of pid" and "compare.controllers.1.gains" in str(caught.value)


def test_without_a_tune_run_or_a_network_the_rest_is_compared() -> None:
    """Where nothing is left there is an error, and with `tuning` its rows stay."""
    settings = "rows: [{controller: pid, gains: tuned}, {controller: feedforward}, {controller: smc, gains: tuned}]"
    study = wristctl.load_study(None, f"compare={{inverses: [network, closed-form], {settings}}}")
    left, left_out = with_what_there_is(study, Inputs())
    assert [each.label for each in left.compare.rows] == ["feedforward/default"]
    assert left.compare.inverses == ("closed-form",) and len(left_out) == 2
    assert "pid/tuned, smc/tuned" in left_out[0] and "network" in left_out[1]
    tuned: Any = SimpleNamespace(study=study, gains={"smc": SMC.presets["exchanged"]}, run=None)
    whole, nothing = with_what_there_is(study, Inputs({"tuned": tuned, "network": tuned}))
    assert whole is study and nothing == []
    alone = wristctl.load_study(None, "compare={inverses: [network], rows: [{controller: pid, gains: tuned}]}")
    assert with_what_there_is(alone, Inputs()) == (alone, [])
    tuning = "tuning: {controllers: [smc]}"
    searched = wristctl.load_study(None, f"compare={{inverses: [none], {settings}, {tuning}}}")
    kept, _ = with_what_there_is(searched, Inputs())
    assert [each.label for each in kept.compare.rows] == ["feedforward/default", "smc/tuned"]


def test_what_is_left_out_is_one_warning_and_no_row(caplog: pytest.LogCaptureFixture) -> None:
    small = "horizon: 0.3, loops: {fast: {plant_segments: 1}}, references: [{duration: 0.2}]"
    rows = "rows: [{controller: pid, gains: tuned}, {controller: feedforward}]"
    done = wristctl.compare(wristctl.load_study(None, f"compare={{{small}, {rows}}}"))
    assert [each.label for each in done.rows] == ["feedforward/default"]
    assert [text.count("pid/tuned") for text in caplog.messages if "left out" in text] == [1]
    assert not any("network" in text for text in caplog.messages), "which nobody asked for"


@pytest.mark.parametrize("asked", ["", "inverses: [network, closed-form], "])
def test_a_network_that_is_missing_is_told_of_where_it_was_asked_for(
    asked: str, caplog: pytest.LogCaptureFixture
) -> None:
    rows = "horizon: 0.3, loops: {fast: {plant_segments: 1}}, references: [{duration: 0.2}], rows: [{controller: pid}]"
    done = wristctl.compare(wristctl.load_study(None, f"compare={{{asked}{rows}}}"))
    assert {row.inverse for row in done.rows} == {"closed-form"}
    assert any("left out: references through a network" in text for text in caplog.messages) == bool(asked)


def test_a_comparison_of_nothing_in_particular_is_of_presets_on_conditions_with_and_without_a_rig() -> None:
    """It needs no earlier run, and has cases enough to rank in each condition."""
    study = wristctl.load_study()
    planned, _ = with_what_there_is(study, Inputs())
    settings = planned.compare
    assert "rollouts" in COMPARE.plan(study, Inputs()) and all(row.gains != "tuned" for row in settings.rows)
    traits = [traits_of([loop], study.wrist) for loop in settings.loops.values()]
    assert {one.rig for one in traits} == {True, False}
    assert len(settings.references) >= FEWEST_WORLDS
    for each in settings.rows:
        check_row(each, None)


def test_gains_that_a_search_of_the_comparison_itself_finds_are_not_asked_for() -> None:
    tuning = (
        "inverses: [none], tuning: {controllers: [pid], candidates: 4, iterations: 3, "
        "loops: {slow: {plant_segments: 2}}, scenarios: [{loop: slow, reference: {kind: step, angle_deg: 7.0}}]}"
    )
    study, other = (
        wristctl.load_study(None, f"compare={{controllers: [{{controller: {name}, gains: tuned}}], {tuning}}}")
        for name in ("pid", "smc")
    )
    planned = COMPARE.plan(study, Inputs()).splitlines()
    assert planned[0].startswith("a search first: ") and planned[1].endswith("rollouts of 5 s")
    with pytest.raises(UserError, match="no tuned gains of smc"):
        COMPARE.plan(other, Inputs())


@pytest.mark.parametrize("rows", ["[pid-ff, adrc]", "[smc/printed]", "[pid/tuned]"])
def test_a_search_whose_gains_no_row_has_is_refused(rows: str) -> None:
    """Its budget would be spent, and nothing of what it finds compared."""
    search = "inverses: [none], tuning: {controllers: [smc], candidates: 8}"
    unused = wristctl.load_study(None, f"compare={{controllers: {rows}, {search}}}")
    tuned: Any = SimpleNamespace(study=unused, gains={"pid": PID.presets["printed"]}, run=None)
    with pytest.raises(UserError, match="gains of smc would be searched") as refused:
        COMPARE.plan(unused, Inputs({"tuned": tuned}))
    assert refused.value.where == "compare.tuning" and "--tune" in refused.value.fix
    used = wristctl.load_study(None, f"compare={{controllers: [feedforward, smc/tuned], {search}}}")
    assert COMPARE.plan(used, Inputs()).startswith("a search first: ")


def test_units_of_the_table_are_those_of_the_metrics(compare: Compare, tmp_path: Path) -> None:
    rmse = [float(k) for k in range(1, 10)]
    rows = [row("fast", STEP, "pid/printed", rmse=rmse)]
    done = compare(rows)
    with pytest.MonkeyPatch.context() as during:
        during.setattr(combinations, "compare", lambda *_: rows)
        during.setattr("wristctl.commands.compare.drawing.draw", lambda *_: None)
        kept = wristctl.compare(done.study, out=tmp_path)
    assert kept.run is not None
    columns = {each["name"]: each for each in _columns(kept.run)}
    assert columns["rmse"]["unit"] == columns["rmse_low"]["unit"] == columns["rmse_high"]["unit"] == "rad"
    assert columns["paper_settling"]["unit"] == "s" and columns["paper_rmse"]["unit"] == "rad"
    repetitions = kept.run.data("repetitions")
    assert list(repetitions["rmse"]) == rmse


def _columns(run: wristctl.Run) -> list[dict[str, Any]]:
    found = next(each for each in run.manifest.outputs if each.path == "data/comparison.csv")
    return [each.model_dump() for each in found.columns]
