"""Trials by their log: a row for each that began, how late ticks were, and what is told of a stop."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, session
from wristctl.commands.hw_run import trials as hw_trials
from wristctl.commands.session import Unattended
from wristctl.records import LiveRun, Run, start_run
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.worlds import Draws
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.log import TrialLog, tick_columns
from wristctl.trial.motions import motion_of
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tick_timing import TickTiming
from wristctl.wrist.directions import ACTIVE

SETTINGS = (
    "seed=4", "hw-run={directions: [ulnar], horizon: 1.0, control_period: 0.01, push: {force: 0.0}, repetitions: 3, "
    "reference: {duration: 0.5, angle_deg: 5.5432}, controllers: [{controller: pid, gains: printed}]}",
)  # fmt: skip
LATE = [1e-3 * k for k in range(101)]


class Watched(Unattended):
    """Remembers what it is told and what it watches."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.trials = 0

    def tell(self, text: str) -> None:
        self.told.append(text)

    @contextmanager
    def watch(self, trials: Sequence[Any], session: Any) -> Iterator[Callable[[Any], None]]:
        assert session.operator is self
        self.trials = len(trials)
        yield print


class Bench:
    """Three trials, of which two begin: the first 2 deg above its reference, the second 1.2346 deg below."""

    late: Sequence[float] = LATE
    stops: BaseException | None = None
    verified = True
    truth = True
    ticks = 100
    odd: Mapping[int, str] = {}

    def __init__(self, settings: Any, wrist: Any, trials: Any, log: TrialLog, *others: Any) -> None:
        assert others == (None, None, None) and wrist.stiffness == 77.0
        self.log, self.trials, self.timing = log, trials, TickTiming(settings.control_period, list(self.late), 7)
        self.motions = {"ulnar": motion_of(settings, wrist, "ulnar")}
        self.outcomes: dict[int, str] = {}
        self.most = {"apart": math.radians(1.0), "jump": math.radians(2.0), "load": 0.3, "across": 0.0}
        self.poses = {"ulnar": None}
        self.zero = SimpleNamespace(plain=lambda: {"marker": 0.5})
        self.stop: Any = None

    def run(self, stand: Any, shown: Any) -> None:
        assert (type(stand), shown) == (BoardStand, print)
        assert (stand._testbed, stand._calibration, stand._draws) == ("testbed", None, Draws(4, "bench"))
        motion = self.motions["ulnar"]
        for number, off in ((0, 2.0), (1, -1.2346)):
            self.outcomes[number] = "ok"
            for time in motion.time[: self.ticks] + 0.0054:
                wanted = float(np.interp(time, motion.time, motion.theta_ref))
                row: dict[str, Any] = dict.fromkeys(tick_columns(1), 0.0)
                row |= {"trial": number, "time": float(time), "theta": wanted + math.radians(off)}
                row |= {
                    "error": math.radians(off),
                    "theta_ref": wanted,
                    "verdict": "",
                    "state": "RUN",
                    "faults": "none",
                }
                self.log.tick(row | {f"tension_{k}": k + 0.1236 for k in ACTIVE})
            if self.truth:
                true = np.zeros((len(motion.time), len(self.log.streams["truth"].columns) - 1))
                true[:, 0], true[:, 5] = motion.time, motion.theta_ref + math.radians(3.0 * off)
                self.log.truth(number, true)
        if self.stops is not None:
            halted = SimpleNamespace(verified=self.verified, seconds=0.25, how="by a ramp")
            self.stop = SimpleNamespace(
                reason="it smokes", halt=halted, trial=1, time=0.25, plain=lambda: {"reason": "it smokes"}
            )
            raise self.stops


Perform = Callable[..., tuple[pd.DataFrame, Run, Watched, Any]]


@pytest.fixture
def perform(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Perform:
    """The trials of such an experiment: their table, the run, who was told, the findings."""

    def opened(settings: Any, bench: Any, seed: int, view: Any, confirm: Any, keep: Any, view_2: Any) -> str:
        assert (bench, seed, view.size, keep, view_2.size) == ("weaker", 4, None, None, None)
        return "testbed"

    monkeypatch.setattr(hw_trials, "Experiment", Bench)
    monkeypatch.setattr(hw_trials, "open_testbed", opened)

    def performed(*settings: str, **how: Any) -> tuple[pd.DataFrame, Run, Watched, Any]:
        study = wristctl.load_study(None, *SETTINGS, "wrist.stiffness=77.0", *settings)
        watched, live = Watched(), None
        for name, value in how.items():
            monkeypatch.setattr(Bench, name, value)
        try:
            with start_run("hw-run", study, "", tmp_path) as live:
                made = replace(session(study, live), operator=watched)
                table = hw_trials.perform_trials(made, "weaker", None, None)  # type: ignore[arg-type]
        except SafetyStop:
            assert isinstance(live, LiveRun)
            table = pd.read_csv(live.path / "data/trials.csv")
        return table, Run(live.path), watched, made.findings

    return performed


@pytest.mark.slow
def test_a_row_is_a_trial_that_began_judged_by_its_own_log(perform: Perform) -> None:
    table, run, watched, _ = perform()
    assert list(table["trial"]) == [0, 1] and list(table["outcome"]) == ["ok", "ok"] and watched.trials == 3
    assert {*table["direction"]} == {"ulnar"} and {*table["controller"]} == {"pid"} and {*table["gains"]} == {"printed"}
    np.testing.assert_allclose(np.degrees(table["rmse"]), [2.0, 1.2346], rtol=1e-2)
    np.testing.assert_allclose(np.degrees(table["true_rmse"]), [6.0, 3.0 * 1.2346], rtol=1e-2)
    assert table["recovery"].isna().all() and list(table["push"]) == [0.0, 0.0]
    columns = columns_of(run, "data/trials.csv")
    assert columns["rmse"] == (METRICS["rmse"].unit, METRICS["rmse"].formula)
    assert columns["true_rmse"] == (METRICS["rmse"].unit, f"{METRICS['rmse'].formula}; of the true angle")
    assert (columns["push"][0], columns["recovery"][0], columns["push_torque"][0]) == ("N", "s", "N m")
    assert columns_of(run, "data/log.csv")["theta"] == ("rad", "bending angle as estimated")
    assert json.loads(run.file("data/zero.json").read_text()) == {"marker": 0.5}
    assert not (run.path / "data/stop.json").exists() and cv2.getNumThreads() == 1


@pytest.mark.slow
def test_what_the_bench_knows_is_logged_of_a_bench_alone(perform: Perform) -> None:
    _, run, _, _ = perform("hw-run.bench.segments=3")
    assert {"theta_1", "theta_3"} < set(run.data("truth").columns) and "theta_4" not in run.data("truth").columns
    table, run, _, _ = perform("hw-run={port: /dev/null}", truth=False)
    assert not (run.path / "data/truth.csv").exists() and table["true_rmse"].isna().all()


@pytest.mark.slow
def test_lateness_is_told_in_quantiles(perform: Perform) -> None:
    _, run, watched, findings = perform("hw-run.real_time=true")
    names = ["ticks", "overruns", "late_p50", "late_p99", "late_max"]
    assert [findings.metrics[name]["value"] for name in names] == pytest.approx([101, 7, 0.05, 0.099, 0.1])
    late = ("s", "lower", 101)
    assert known_of(findings, *names) == [("", "", 1), ("", "lower", 1), late, late, late]
    text = "101 ticks of 10 ms, late by 50.00 ms (p50), 99.00 ms (p99), 100.00 ms at most; 7 overruns"
    assert watched.told == [text] and text in run.file("README.md").read_text()


@pytest.mark.parametrize(
    ("settings", "late", "told"),
    [
        ((), LATE, 0),
        (("hw-run={port: /dev/null}",), LATE, 1),
        (("hw-run.real_time=true",), [], 0),
        (("hw-run={port: /dev/null}",), [], 0),
    ],
)
@pytest.mark.slow
def test_lateness_is_shown_where_time_is_real_and_ticks_there_were(
    perform: Perform, settings: tuple[str, ...], late: list[float], told: int
) -> None:
    _, _, watched, findings = perform(*settings, late=late, truth=not settings or "port" not in settings[0])
    assert len(watched.told) == told and findings.metrics["ticks"]["value"] == len(late)


def test_a_stop_before_any_tick_has_no_table(perform: Perform, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        _, run, _, _ = perform(stops=SafetyStop("it smokes", "bench", "water"), ticks=0, truth=False)
    assert "the motors stand" in caplog.messages[-1] and "it smokes" in run.file("README.md").read_text()
    assert "The last second" not in run.file("README.md").read_text()


@pytest.mark.parametrize(("verified", "said"), [(True, "the motors stand"), (False, "could NOT be seen to stand")])
@pytest.mark.slow
def test_a_stop_is_told_with_the_last_second_by_tenths(
    perform: Perform, caplog: pytest.LogCaptureFixture, verified: bool, said: str
) -> None:
    with caplog.at_level(logging.WARNING):
        table, run, _, _ = perform(stops=SafetyStop("it smokes", "bench", "water"), verified=verified)
    assert len(table) == 2 and run.state == "failed"
    assert json.loads(run.file("data/stop.json").read_text()) == {"reason": "it smokes"}
    halted, last = (record.getMessage() for record in caplog.records)
    assert said in halted and "after 250 ms (by a ramp)" in halted
    readme = run.file("README.md").read_text()
    assert last.startswith("The last second\n") and last in readme and "it smokes" in readme
    assert "it smokes" not in halted + last, "the error that is raised says it"
    head, _, *rows = last.splitlines()[2:]
    assert [part.strip() for part in head.split("  ") if part] == [
        "time [s]", "theta [deg]", "reference [deg]", "marker", "T1 [N]", "T2 [N]", "T4 [N]", "T5 [N]", "state",
    ]  # fmt: skip
    cells = [row.split() for row in rows]
    times = [float(row[0]) for row in cells]
    assert times == pytest.approx(np.arange(0.095, 1.0, 0.1), abs=1e-9), "the last of each tenth"
    assert cells[-1] == ["0.995", "4.31", "5.54", "none", "1.12", "2.12", "4.12", "5.12", "RUN"]


@pytest.mark.parametrize(("trials", "told"), [((0,), []), ((0, -1), ["0", "none"]), ((-1,), ["none"])])
def test_the_last_second_has_what_was_seen_and_whose_its_times_are(trials: tuple[int, ...], told: list[str]) -> None:
    """A picture comes every sixth tick; the return after a trial counts its time anew, and is of none."""
    rows = [
        {"trial": trial, "time": 0.01 * k, "theta": 0.0, "theta_ref": 0.0, "state": "RUN"}
        | {"verdict": "ok" if k % 6 == 0 else "", "tension_1": 1.0}
        for trial in trials
        for k in range(100 // len(trials))
    ]
    table = hw_trials._last_second(SimpleNamespace(last=rows), False)  # type: ignore[arg-type]
    assert [row[table.columns.index("marker")] for row in table.rows] == ["ok"] * 10
    assert ("trial" in table.columns) is bool(told)
    if told:
        assert list(dict.fromkeys(str(row[0]) for row in table.rows)) == told
    unseen = hw_trials._last_second(SimpleNamespace(last=[row | {"verdict": ""} for row in rows]), False)  # type: ignore[arg-type]
    assert {row[unseen.columns.index("marker")] for row in unseen.rows} == {"none"}


@pytest.mark.slow
def test_a_few_ticks_are_all_told(perform: Perform, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        perform(ticks=7, stops=SafetyStop("it smokes", "bench", "water"))
    assert len(caplog.messages[-1].splitlines()) == 4 + 14, "seven of each trial"


@pytest.mark.slow
def test_a_log_that_cannot_be_closed_is_a_safety_stop_unless_something_stopped_it_before(
    perform: Perform, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = TrialLog.close

    def full(self: TrialLog) -> None:
        closed(self)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(TrialLog, "close", full)
    with pytest.MonkeyPatch.context() as during:
        during.setattr(Bench, "stops", KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            perform()
    _, run, _, _ = perform()
    assert "the log cannot be written: No space left on device" in run.file("run.json").read_text()


@pytest.mark.slow
def test_what_was_odd_and_how_near_it_came_to_the_limits_is_told(
    perform: Perform, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        table, run, _, findings = perform(odd={0: "", 1: "no usable marker angle for 120 ms"})
    assert table["odd"].tolist() == ["", "no usable marker angle for 120 ms"]
    said = "Trial 1 went through, but was odd: no usable marker angle for 120 ms"
    assert [record.getMessage() for record in caplog.records] == [said]
    readme = run.file("README.md").read_text()
    assert said in readme
    greatest = "jump 2.0 deg of 2.0 deg, across 0.0 deg of 1.0 deg, load 0.30 N m of 1.60 N m, apart 1.0 deg of 3.5 deg"
    assert greatest in readme
    assert findings.metrics["greatest_load"]["value"] == 0.3


@pytest.mark.parametrize(
    ("trial", "time", "began", "when"),
    [
        (None, None, 0, "before the first trial"),
        (None, None, 2, "after trial 1 (of 4, from 0)"),
        (2, 0.53, 3, "in trial 2 (of 4, from 0), 0.5 s"),
    ],
)
def test_a_stop_says_when_it_was_and_what_was_done_before(
    trial: int | None, time: float | None, began: int, when: str
) -> None:
    halted = SimpleNamespace(verified=False)
    stop: Any = SimpleNamespace(reason="stopped: it smokes", trial=trial, time=time, halt=halted)
    outcomes = ["ok", "ok", "it smokes"][:began]
    table = pd.DataFrame(
        {
            "trial": range(began), "direction": "ulnar", "push": [0.0, 2.0, 0.0][:began], "controller": "mpc",
            "gains": "own", "outcome": outcomes, "rmse": math.radians(0.25),
        }
    )  # fmt: skip
    first, _, *done = hw_trials.stopped_answer(stop, table, 4)
    assert when in first and "it smokes" in first and "could NOT be seen" in first
    assert len(done) == outcomes.count("ok") and all("0.25 deg" in line for line in done)
    assert not done or ("push of 2 N" in done[1] and "push" not in done[0])
