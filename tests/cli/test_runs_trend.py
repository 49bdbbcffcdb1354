"""`runs trend` finds a drift of known size in sealed runs of one rig, and none where there is none."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.identification.rig_trend import FALSE_ALARM, FEWEST, Reading, Trend, trends_of
from wristctl.records import start_run
from wristctl.records.find import list_runs
from wristctl.study_files.load import load_study
from wristctl.wrist.directions import ACTIVE, DIRECTIONS

DAY = 86400.0
LOAD, CONTRACTION = 0.05, 40.0
STUDY = Study()
Make = Callable[..., None]


def log_of(stiffness: float, way: float, believed: float) -> pd.DataFrame:
    """Ticks of an ulnar and a radial trial: to 30 deg within a second, then at rest, under a constant load too."""
    tables = []
    for trial, name in enumerate(("ulnar", "radial")):
        time = np.arange(0.0, 2.5, 0.02)
        theta = DIRECTIONS[name].sign * math.radians(30.0) * np.minimum(time, 1.0)
        ticks = pd.DataFrame({"trial": trial, "time": time, "theta_ref": theta, "theta": theta})
        ticks["rate_ref"] = np.where(time < 1.0, 0.5, 0.0)
        ticks["load"] = (believed - stiffness) * theta + LOAD
        for tendon in ACTIVE:
            side = 1.0 if tendon in DIRECTIONS["ulnar"].tendons else -1.0
            ticks[f"position_{tendon}"] = CONTRACTION + side * way * theta
        tables.append(ticks)
    return pd.concat(tables)


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Seals hw-run runs of a rig, a value of each quantity per run."""

    def sealed(stiffness: list[float], way: list[float], study: Study = STUDY) -> None:
        for number, (stiff, steps) in enumerate(zip(stiffness, way, strict=True)):
            with start_run("hw-run", study, f"k{number}", tmp_path / "results", ["wristctl", "hw-run"]) as run:
                rows = [(k, name, 0.0, "ok") for k, name in enumerate(("ulnar", "radial"))]
                run.table(
                    "data/trials.csv", pd.DataFrame(rows, columns=["trial", "direction", "push", "outcome"]), {}, {}
                )
                run.table("data/log.csv", log_of(stiff, steps, study.wrist.stiffness), {}, {})
                zero = {"marker": 0.01, "slack": [3e-4] * 4, "steps_per_radian": [1900.0] * 4, "friction": [1e-5] * 4}
                run.file("data/zero.json").write_text(json.dumps(zero))

    return sealed


@pytest.mark.parametrize("per_run", [-0.012, 0.012])
@pytest.mark.slow
def test_springs_that_change_are_found_with_their_size_and_the_pulley_is_not_blamed(
    call: Call, make: Make, per_run: float
) -> None:
    scatter = np.random.default_rng(3).normal(size=(2, 6))
    make((0.43 + per_run * np.arange(6) + 0.002 * scatter[0]).tolist(), (970.0 + scatter[1]).tolist())
    code, out, _ = call("runs", "trend", "--figure", "trend.png")
    assert code == 3 and out.startswith("1 of 9 quantities drift over 6 runs")
    assert f"- stiffness, ulnar {'falls' if per_run < 0.0 else 'rises'} by" in out and Path("trend.png").stat().st_size
    code, out, _ = call("runs", "trend", "--json")
    shown = json.loads(out)
    stiffness, way = (
        next(line for line in shown["quantities"] if line["name"] == f"{name}, ulnar")
        for name in ("stiffness", "steps per radian")
    )
    assert code == 3 and stiffness["drifts"] and not way["drifts"]
    assert stiffness["interval"][0] < per_run < stiffness["interval"][1]
    assert stiffness["slope"] == pytest.approx(per_run, abs=2e-3)
    values = [run["values"]["stiffness, ulnar"] for run in shown["runs"]]
    expected = 0.43 + per_run * np.arange(6) + 0.002 * scatter[0]
    assert values == pytest.approx(expected.tolist(), abs=1e-9), "a constant load cancels between both directions"
    assert [run["values"]["slack of tendon 1"] for run in shown["runs"]] == pytest.approx([0.3] * 6)
    ways = [run["values"]["steps per radian, ulnar"] for run in shown["runs"]]
    assert ways == pytest.approx((970.0 + scatter[1]).tolist()), "what both sides are reeled in by cancels"


@pytest.mark.slow
def test_a_rig_that_only_scatters_drifts_nowhere_and_one_run_or_two_rigs_are_refused(call: Call, make: Make) -> None:
    scatter = np.random.default_rng(5).normal(size=(2, 5))
    make((0.43 + 0.01 * scatter[0]).tolist(), (970.0 + scatter[1]).tolist())
    code, out, _ = call("runs", "trend")
    assert code == 0 and out.startswith("Nothing drifts: 9 quantities of 5 runs")
    code, out, err = call("runs", "trend", "latest:hw-run")
    assert code == 2 and out == "" and f"takes {FEWEST}" in err and "name more runs" in err
    own = [run.id for run in list_runs(Path("results"))]
    make([0.43] * 2, [970.0] * 2, load_study((), ["hw-run.actuator.pulley_radius=0.01", "wrist.stiffness=0.7"]))
    others = [run.id for run in list_runs(Path("results")) if run.id not in own]
    code, _, err = call("runs", "trend")
    said = " ".join(err.split())
    assert code == 2 and "of 2 rigs" in said and f"{', '.join(own[:3])} and 2 more" in said
    assert "wrist.stiffness 0.7, actuator.pulley_radius 0.01: " + ", ".join(others) in said
    assert f"wristctl runs trend {' '.join(own)}" in said
    assert call("runs", "trend", *own)[0] == 0


def readings_of(values: np.ndarray, days: np.ndarray) -> list[Reading]:
    """A reading per row of values, each column a quantity."""
    names = ("stiffness, ulnar", "stiffness, flexion", "steps per radian, ulnar", "friction at homing",
             *(f"slack of tendon {tendon}" for tendon in ACTIVE))  # fmt: skip
    return [
        Reading(f"run-{k}", DAY * day, MappingProxyType(dict(zip(names, row.tolist(), strict=True))))
        for k, (row, day) in enumerate(zip(values, days, strict=True))
    ]


@pytest.mark.slow
def test_a_set_of_runs_without_a_drift_is_blamed_in_one_of_twenty_and_intervals_hold_the_slope() -> None:
    rng, sets, runs = np.random.default_rng(1), 150, 8
    blamed, inside = 0, list[bool]()
    slopes = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(sets):
        noise = rng.normal(size=(runs, 8))
        blamed += any(line.drifts for line in trends_of(readings_of(noise, np.arange(runs))))
        drifting = trends_of(readings_of(noise + np.arange(runs)[:, None] * slopes, np.arange(runs)))
        inside += [line.low <= slope <= line.high for line, slope in zip(drifting, slopes, strict=True)]
    assert abs(blamed / sets - FALSE_ALARM) < 3.0 * math.sqrt(FALSE_ALARM * 0.95 / sets)
    assert abs(np.mean(inside) - 0.95) < 3.0 * math.sqrt(0.95 * 0.05 / len(inside))


def test_slopes_are_per_run_in_order_of_time_or_per_day() -> None:
    days = np.array([9.0, 0.0, 1.0, 4.0])
    values = np.tile(2.0 + 0.5 * days[:, None], 8) + 1e-3 * np.random.default_rng(2).normal(size=(4, 8))
    by_day: list[Trend] = trends_of(readings_of(values, days), per_day=True)
    assert all(line.drifts and line.slope == pytest.approx(0.5, abs=2e-3) for line in by_day)
    assert all(line.change == pytest.approx(4.5, abs=2e-2) for line in by_day)
    (by_run,) = {round(line.slope, 2) for line in trends_of(readings_of(values, days))}
    assert by_run == pytest.approx(np.polyfit(range(4), 2.0 + 0.5 * np.sort(days), 1)[0], abs=1e-2)
    with pytest.raises(UserError, match="one moment"):
        trends_of(readings_of(values, np.zeros(4)), per_day=True)
    with pytest.raises(UserError, match=f"takes {FEWEST}"):
        trends_of(readings_of(values[:2], days[:2]))


def test_what_never_changes_drifts_nowhere() -> None:
    lines = trends_of(readings_of(np.ones((5, 8)), np.arange(5)))
    assert not any(line.drifts for line in lines) and {line.slope for line in lines} == {0.0}


NAMED = tuple(f"run-{k}" for k in range(4))


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Reading]:
    """Readings of `NAMED`, a day apart, in place of runs: a stiffness falls steadily from 20 to 17, a slack rises from
    1 mm by 0.5 mm a run, and all else stands."""
    values = np.full((4, 8), 2.0) + 1e-6 * np.random.default_rng(4).normal(size=(4, 8))
    values[:, 0] = [20.0, 19.001, 17.999, 17.0]
    values[:, 4] = [1.0, 1.502, 1.998, 2.5]
    found = readings_of(values, np.arange(4.0))
    by_id = {reading.run: reading for reading in found}
    module = import_module("wristctl.cli.runs.trend")  # its function has the same name
    monkeypatch.setattr(module, "require", lambda name, kind, out: SimpleNamespace(id=name, reading=nullcontext))
    monkeypatch.setattr("wristctl.identification.rig_trend.check_one_rig", lambda runs: None)
    monkeypatch.setattr("wristctl.identification.rig_trend.reading_of", lambda run: by_id[run.id])
    return found


@pytest.mark.parametrize("per", ["run", "day"])
def test_a_fall_and_a_rise_are_told_by_their_size_with_the_lesser_end_first_the_larger_share_on_top(
    call: Call, measured: list[Reading], per: str
) -> None:
    """Of runs named in any order; the changes in all are 3 of 18.5 and 1.5 of 1.75."""
    code, out, _ = call("runs", "trend", *NAMED[::-1], "--per", per)
    told = re.findall(
        rf"^- (.+) (rises|falls) by ([\d.]+) \[([\d.]+), ([\d.]+)\] (.+) per {per}, ([\d.]+) % in all\n  likely: .",
        out,
        re.MULTILINE,
    )
    assert code == 3 and out.startswith("2 of 8 quantities drift over 4 runs")
    assert [(name, way, unit) for name, way, *_, unit, _ in told] == [
        ("slack of tendon 1", "rises", "mm"),
        ("stiffness, ulnar", "falls", "N m/rad"),
    ]
    for (_, _, size, low, high, _, share), slope, whole in zip(told, (0.5, 1.0), (1.5 / 1.75, 3.0 / 18.5), strict=True):
        assert float(low) < float(size) < float(high) and float(size) == pytest.approx(slope, abs=2e-3)
        assert float(share) == pytest.approx(100.0 * whole, abs=0.2)
    columns = [line for line in out.splitlines() if "run-0" in line]
    assert len(columns) == 1 and re.findall(r"run-\d", columns[0]) == list(NAMED), "oldest first"
