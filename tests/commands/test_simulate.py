"""One loop as it is told: every metric once, or medians with intervals; its trajectory, figures, warnings, plan."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, repeated, session
from wristctl.commands import printed_table as answer_lines
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import check_inverse
from wristctl.commands.printed_table import degrees
from wristctl.commands.simulate.command import SIMULATE
from wristctl.commands.simulate.results import Simulated
from wristctl.comparison.repetition_spread import spread
from wristctl.config.loop import Reference
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.simulation import closed_loop
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.repetitions import Repeated
from wristctl.simulation.trajectory import COLUMNS

NINE = [float(k) for k in range(1, 10)]
Simulate = Callable[..., Simulated]


@pytest.fixture
def simulate(monkeypatch: pytest.MonkeyPatch) -> Simulate:
    """A loop that came out like this."""

    def simulated(outcome: Repeated, *settings: str, run: Any = None) -> Any:
        def simulation(study: Any, network: Any, tuned: Any) -> Repeated:
            assert study.simulate.horizon == 2.0 and network is None and tuned is None
            return outcome

        monkeypatch.setattr(closed_loop, "simulate", simulation)
        return SIMULATE.perform(session(wristctl.load_study(None, "simulate.horizon=2.0", *settings), run))

    return simulated


def test_of_one_rollout_every_metric_is_told(simulate: Simulate) -> None:
    once = repeated("smc/exchanged", [0.25], settling=3.0, recovery=4.0)
    done = simulate(once)
    (table,) = done.tables
    assert table.title == "smc/exchanged" and table.columns == ("metric", "value", "unit", "meaning")
    assert [row[0] for row in table.rows] == list(METRICS) == list(done.metrics)
    for name, value, unit, meaning in table.rows:
        assert (value, unit, meaning) == (once.first.metrics[name], METRICS[name].unit, METRICS[name].formula)
        assert done.metrics[name] == value and done.findings.metrics[name]["meaning"] == meaning
    assert known_of(done.findings, "rmse", "settling") == [("rad", "lower", 1), ("s", "lower", 1)]
    assert list(done.figures) == ["course", "angle", "error", "tensions", "sliding", "motion"] and not done.failed
    np.testing.assert_array_equal(done.frame()["theta"], once.first.trajectory.theta)


@pytest.mark.parametrize(
    ("settings", "verdict"),
    [
        (["simulate.controller=feedforward"], "ok"),
        (["simulate.controller=super-twisting", "wrist.length=0.12"], "chatters"),
        (["simulate.controller=feedforward", "simulate.loop.plant.stiffness=x2"], "does not arrive"),
    ],
)
def test_the_badge_of_a_loops_page_is_its_verdict(settings: list[str], verdict: str, tmp_path: Path) -> None:
    base = ["simulate.gains=default", "simulate.horizon=2.5"]
    done = wristctl.simulate(wristctl.load_study(None, *base, *settings), out=tmp_path)
    assert done.run is not None and done.run.state == "ok" and done.run.manifest.exit_code == 0
    text = done.run.file("report.html").read_text()
    assert f">{verdict}</span>" in text and ('class="state ok"' in text) == (verdict == "ok")
    assert (verdict in done.tables[0].title.lower()) == (verdict != "ok")
    assert all(len(line) <= answer_lines.COLUMNS for line in done.summary), "no line is cut off at a page's edge"
    text = " ".join(done.summary)
    assert (verdict in text) == (verdict != "ok") and len(done.summary) <= 24
    assert (
        f"RMSE {degrees(done.metrics['rmse'])} deg" in text
        and f"{degrees(done.metrics['steady_state'])} deg off" in text
    )
    assert bool(done.short_of) == bool(done.advice) == (verdict == "does not arrive")


def test_of_repetitions_medians_are_told_with_their_interval(simulate: Simulate) -> None:
    done = simulate(repeated("smc/exchanged", NINE, settling=3.0))
    (table,) = done.tables
    assert table.title == "smc/exchanged, 9 repetitions"
    assert table.columns == ("metric", "median", "95 % low", "95 % high", "unit", "meaning")
    rows = {str(row[0]): row[1:] for row in table.rows}
    expected = spread(np.array(NINE))
    assert rows["rmse"] == (5.0, expected.low, expected.high, "rad", METRICS["rmse"].formula)
    assert 1.0 < expected.low < 5.0 < expected.high < 9.0 or (expected.low, expected.high) == (1.0, 9.0)
    assert rows["settling"][:3] == (3.0, 3.0, 3.0)
    metric = done.findings.metrics["rmse"]
    assert (metric["value"], metric["n"], metric["interval"]) == (5.0, 9, (expected.low, expected.high))
    assert (metric["unit"], metric["better"], metric["meaning"]) == (
        "rad",
        "lower",
        f"{METRICS['rmse'].formula}; median",
    )
    assert list(done.figures) == ["course", "error-repetitions", "angle", "error", "tensions", "sliding", "motion"]


def test_two_repetitions_are_several(simulate: Simulate) -> None:
    done = simulate(repeated("smc/exchanged", [1.0, 3.0]))
    assert done.metrics["rmse"] == 2.0 and "error-repetitions" in done.figures
    assert done.tables[0].title == "smc/exchanged, 2 repetitions"


@pytest.mark.parametrize(("failed", "said"), [(0, False), (1, True), (9, True)])
def test_one_repetition_that_fails_is_a_failure(simulate: Simulate, failed: int, said: bool) -> None:
    done = simulate(repeated("smc/exchanged", NINE, failed=failed))
    assert done.failed is said
    count = f"in {failed} of 9 repetitions, 9 repetitions"
    assert (f", FAILED: left its range at 0.5 s {count}" in done.tables[0].title) == said
    assert (done.fault is not None and done.fault.exit_code == 3 and "left its range" in done.fault.what) == said


def test_a_run_keeps_the_trajectory_with_units_and_every_repetition(simulate: Simulate, tmp_path: Path) -> None:
    with start_run("simulate", wristctl.load_study(None), "", tmp_path) as live:
        done = simulate(repeated("smc/exchanged", [1.0, 3.0], failed=1), run=live)
    run = Run(live.path)
    table, columns = run.data("trajectory"), columns_of(run, "data/trajectory.csv")
    assert columns["theta_1"] == ("rad", "bending angle of one segment") and "theta_2" not in columns
    assert {name: columns[name] for name in COLUMNS if name in columns} == {
        name: (unit, meaning) for name, (unit, meaning) in COLUMNS.items() if name in columns
    }
    np.testing.assert_allclose(table["theta"], done.frame()["theta"])
    each = run.data("repetitions")
    assert list(each["repetition"]) == [0, 1] and list(each["failed"]) == [False, True]
    assert list(each["rmse"]) == [1.0, 3.0]
    assert columns_of(run, "data/repetitions.csv")["rmse"][0] == "rad"


def test_angles_beyond_what_the_network_learned_are_warned_of(
    simulate: Simulate, caplog: pytest.LogCaptureFixture
) -> None:
    for outside in (0.0, 0.25):
        once = repeated("smc/exchanged")
        course = replace(once.first.trajectory, outside=outside)
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            done = simulate(replace(once, first=replace(once.first, trajectory=course)))
        assert ("25 % of the wanted tips lie outside" in caplog.text) == (outside > 0.0)
        assert ("led by guesses: 25 % of its tips" in done.answer.sentence) == (outside > 0.0)


def test_behind_a_network_the_error_to_the_angle_that_was_wanted_of_it_is_told(simulate: Simulate) -> None:
    once = repeated("smc/exchanged")
    own = once.first.trajectory
    asked = replace(own, theta_desired=own.theta_ref + 0.1)
    for course, told in ((own, False), (asked, True)):
        found = replace(once, first=replace(once.first, trajectory=course))
        assert ("wanted of the network" in simulate(found).answer.sentence) == told


def test_a_network_that_no_reference_goes_through_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    network: Any = {"network": None}
    for inverse, given, warned in (("none", {}, False), ("none", network, True), ("network", network, False)):
        caplog.clear()
        check_inverse(Reference.model_validate({"inverse": inverse}), Inputs(given))
        assert ("does not go through the network" in caplog.text) == warned


def plan(*settings: str) -> str:
    return SIMULATE.plan(wristctl.load_study(None, "simulate.horizon=2.5", *settings), Inputs())


def test_a_plan_counts_the_rollouts() -> None:
    assert plan() == plan("simulate.repetitions=7") == "one rollout of 2.5 s", "nothing is random"
    random = ("simulate.loop.sensor={level: camera}", "simulate.loop.actuator.level=tendon")
    assert plan("simulate.repetitions=7", *random) == "7 rollouts of 2.5 s"
    assert plan("simulate.repetitions=2", *random) == "2 rollouts of 2.5 s"
    assert plan("simulate.repetitions=1", *random) == "one rollout of 2.5 s"
    with pytest.raises(UserError) as caught:
        plan("simulate.gains=tuned")
    assert caught.value.where == "simulate.gains"


def test_a_reference_through_a_network_needs_one() -> None:
    with pytest.raises(UserError, match="none is given"):
        plan("simulate.reference.inverse=network")
    assert {(need.leaf, need.kind): need.optional for need in SIMULATE.needs} == {
        ("network", "train"): True, ("tuned", "tune"): True, ("from_identified", "identify"): True,
    }  # fmt: skip


def test_an_answer_names_its_scenario_wrist_and_gains_and_of_repetitions_has_a_table(simulate: Simulate) -> None:
    settings = ["simulate={controller: pid, gains: 'Kp=10,Ki=2,Kd=0.1', direction: radial, horizon: 1.0}"]
    own = [
        "simulate.loop={actuator: {level: tendon}, sensor: {level: camera}, control_period: 5.0e-3}",
        "wrist.length=0.12",
    ]
    text = " ".join(wristctl.simulate(wristctl.load_study(None, *settings, *own)).summary)
    for fact in ("30 deg radial in 1 s", "120 mm", "elastic tendons", "60 Hz", "5 ms", "Kp = 10, Ki = 2, Kd = 0.1"):
        assert fact in text, fact
    several = simulate(repeated("smc/exchanged", NINE, settling=3.0)).answer
    assert several.table is not None and several.table.columns[1:4] == ("median of 9", "95 % low", "95 % high")
    few = simulate(repeated("smc/exchanged", NINE[:5], settling=3.0)).answer
    assert few.table is not None and few.table.columns == ("figure", "median of 5", "unit")
    assert "95 % intervals take 6" in few.sentence and "intervals" not in several.sentence
    rows = {str(row[0]): row[1:] for row in several.table.rows}
    expected = spread(np.array(NINE))
    assert rows["RMSE"] == (5.0, expected.low, expected.high, "rad")
    (shown,) = [line.split() for line in several.lines() if line.startswith("RMSE ")]
    assert shown[-1] == "deg" and float(shown[1]) == pytest.approx(np.degrees(5.0), rel=5e-3), "as people read it"
    assert simulate(repeated("smc/exchanged")).answer.table is None


@pytest.mark.parametrize(("command", "settings"), [("simulate", {"horizon": 0.5}), ("analyse", {"angles_deg": [0.0]})])
def test_an_answer_says_where_the_rest_is_of_a_run_and_of_a_result_in_memory(
    command: str, settings: dict[str, Any], tmp_path: Path
) -> None:
    call = getattr(wristctl, command)
    told = [call(controller="pid-ff", **settings, **kept).answer.more for kept in ({}, {"out": tmp_path})]
    assert [(".tables" in more, "--all" in more) for more in told] == [(True, False), (False, True)]
