"""A sweep gives at each point what the command gives there, in one table with units, whoever computes it."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal

import wristctl
from wristctl.commands.simulate.results import Simulated
from wristctl.commands.sweep.answer import answer, headline, quantities, sentence
from wristctl.commands.sweep.figures import over_setting
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.simulation import swept_loops
from wristctl.simulation.oscillation import LIMIT_CYCLE

FAST = (
    "simulate.controller=pid-ff", "simulate.gains=hardware", "simulate.loop.plant_segments=1", "simulate.horizon=0.6",
    "simulate.reference.duration=0.3",
)  # fmt: skip
CAMERA = ("simulate.loop.sensor.level=camera", "simulate.loop.control_period=5e-3", "simulate.repetitions=2")


def swept(study: Study, *sweep: str) -> Study:
    return study.model_copy(update={"sweep": sweep})


def at(*overrides: str) -> Simulated:
    return wristctl.simulate(wristctl.load_study(None, *FAST, *overrides))


@pytest.mark.parametrize(
    "key, values, others",
    [
        ("wrist.hand_mass", ("0.2", "0.35"), ()),
        ("simulate.loop.actuator.lag", ("0.004", "0.01"), ("simulate.loop.actuator.level=lagged",)),
        ("simulate.loop.sensor.noise_deg", ("0.02", "0.2"), CAMERA),
        ("simulate.loop.plant.stiffness", ("x0.8", "x1.2"), ()),
        ("simulate.reference.angle_deg", ("-20", "35"), ()),
        ("simulate.reference.frequency", ("0.6", "1.4"), ("simulate.reference.kind=sine", "simulate.horizon=2.5")),
        ("simulate.reference.kind", ("minimum-jerk", "sine"), ("simulate.horizon=2.5",)),
        ("simulate.reference.end_frequency", ("2.0", "4.0"), ("simulate.reference.kind=chirp", "simulate.horizon=2.5")),
        (
            "simulate.reference.duration",
            ("0.1", "0.25"),
            ("simulate.reference.kind=tip-path", "simulate.reference.inverse=closed-form"),
        ),
        ("simulate.controller", ("pid-ff", "computed-torque"), ("simulate.gains=default",)),
    ],
)
def test_a_point_of_a_sweep_is_the_rollout_that_simulate_makes_there(
    key: str, values: tuple[str, str], others: tuple[str, ...]
) -> None:
    study = wristctl.load_study(None, *FAST, *others)
    table = wristctl.simulate(swept(study, f"{key}={','.join(values)}")).frame()
    for number, value in enumerate(values):
        alone = at(*others, f"{key}={value}").repeated
        rows = table[table["point"] == number]
        for name in ("rmse", "chattering", "oscillation", "energy"):
            assert rows[name].to_list() == pytest.approx(alone.metrics[name].tolist(), rel=1e-12, nan_ok=True), name
        assert rows["failed"].to_list() == alone.failed.tolist()


def test_what_is_run_in_many_batches_comes_back_in_the_order_of_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    study = wristctl.load_study(None, *FAST, *CAMERA)
    asked = swept(study, "simulate.controller=pid-ff,pid-dob", "simulate.reference.angle_deg=5,10,20")
    together = wristctl.simulate(asked).frame()
    monkeypatch.setattr("wristctl.simulation.swept_loops.at_most", lambda *_: 2)
    assert_frame_equal(wristctl.simulate(asked).frame(), together)


def test_no_batch_is_run_before_all_but_the_last_are_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """The samples of a long sweep would fill the memory of a machine that runs faster than it judges."""
    seen, run, judged = list[str](), swept_loops._run, swept_loops._judged

    def slowly(*given: Any) -> Any:
        time.sleep(0.05)
        found = judged(*given)
        seen.append("judged")
        return found

    def told(*given: Any) -> Any:
        seen.append("run")
        return run(*given)

    monkeypatch.setattr(swept_loops, "at_most", lambda *_: 1)
    monkeypatch.setattr(swept_loops, "_run", told)
    monkeypatch.setattr(swept_loops, "_judged", slowly)
    wristctl.simulate(swept(wristctl.load_study(None, *FAST), "simulate.reference.angle_deg=5,10,15,20,25"))
    for number, at in enumerate(k for k, what in enumerate(seen) if what == "run"):
        assert seen[:at].count("judged") >= number - 1
    assert seen.count("run") == seen.count("judged") == 5


@pytest.mark.parametrize("given", ["", "simulate.gains=by-loop"])
def test_controllers_and_loops_that_are_swept_have_each_the_gains_that_simulate_gives_them(given: str) -> None:
    sweep = "sweep=['controller=smc,pid-ff,pid', 'loop.actuator.level=ideal,tendon']"
    study = wristctl.load_study(None, sweep, *([given] if given else []))
    swept: Any = wristctl.simulate(study)
    for row in swept.frame().to_dict("records"):
        controller, level = row["simulate.controller"], row["simulate.loop.actuator.level"]
        alone = wristctl.simulate(controller=controller, loop={"actuator": {"level": level}})
        assert row["rmse"] == pytest.approx(alone.metrics["rmse"], rel=1e-9), (controller, level)
    told = "Gains by loop: smc/hardware, pid-ff/default, pid-ff/hardware, pid/printed."
    assert told in " ".join(swept.answer.lines())


def test_gains_are_swept_from_the_preset_they_stand_in_for() -> None:
    study = wristctl.load_study(None, *FAST)
    table = wristctl.simulate(swept(study, "simulate.gains.Kp=2,8")).frame()
    assert table["rmse"][1] < table["rmse"][0]


@pytest.mark.painted
@pytest.mark.slow
def test_a_sweep_is_one_run_with_a_table_with_units_and_a_figure_for_each_key(tmp_path: Path) -> None:
    study = swept(wristctl.load_study(None, *FAST), "wrist.stiffness=0.4..0.9:4", "simulate.controller=pid-ff,pd-ff")
    done = wristctl.simulate(study, out=tmp_path)
    assert done.run is not None and len(done.frame()) == 8
    (table,) = [each for each in done.run.manifest.outputs if each.path == "data/sweep.csv"]
    units = {each.name: each.unit for each in table.columns}
    assert units["wrist.stiffness"] == "N m/rad" and units["rmse"] == "rad" and units["energy"] == "J"
    for key in ("wrist.stiffness", "simulate.controller"):
        assert (done.run.path / "figures" / f"sweep-{key}.png").is_file()
    best = done.frame().sort_values("rmse").iloc[0]
    said = " ".join((done.run.path / "README.md").read_text().split())
    assert f", controller = {best['simulate.controller']}" in said and "lowest RMSE " in said
    listed = wristctl.runs("points=8", kind="simulate", out=tmp_path)
    assert listed["rmse_least"].iloc[0] == best["rmse"]


def test_the_answer_of_a_sweep_is_in_degrees_in_the_order_of_its_values_and_fits_one_screen() -> None:
    done = wristctl.simulate(swept(wristctl.load_study(None, *FAST), "wrist.stiffness=~0.4..0.9:30"))
    table, lines = done.frame(), done.summary
    best = table.iloc[int(table["rmse"].argmin())]
    assert f"lowest RMSE {np.rad2deg(best['rmse']):.3g} deg at wrist.stiffness = " in " ".join(lines)
    shown = [float(line.split()[0]) for line in lines if re.match(r" *0\.\d+  ", line)]
    assert shown == sorted(shown) and 6 < len(shown) < 30
    assert shown[0] == pytest.approx(table["wrist.stiffness"].min(), rel=5e-3)
    assert shown[-1] == pytest.approx(table["wrist.stiffness"].max(), rel=5e-3)
    assert len(lines) <= 24 and max(map(len, lines)) <= 100 and "[rad]" not in "".join(lines)


def test_of_errors_that_nobody_could_measure_none_is_least() -> None:
    frame = pd.DataFrame({"k": ["a", "b", "c"], "point": [0, 1, 2], "rmse": np.radians([2e-4, 1e-4, 0.5])})
    key, _, rmse = quantities(frame, {"k": "1"}, {}).values()
    assert "below 0.001 deg at 2 of 3 rollouts, such as k = b; highest 0.5 deg at k = c" in sentence(
        "simulate", frame, [key], [rmse]
    )
    tiny = sentence("simulate", frame[:2], [key], [rmse])
    assert "below 0.001 deg at every point" in tiny and "most" not in tiny
    assert "lowest RMSE 0.5 deg at k = c" in sentence("simulate", frame[2:], [key], [rmse])


def test_a_figure_of_a_sweep_has_a_line_for_each_value_of_a_second_setting_and_marks_what_is_no_good() -> None:
    """The line of a controller is that of its own rollouts; a failed one has a cross and is part of no line."""
    frame = pd.DataFrame(
        {
            "stiffness": [1.0, 2.0, 3.0] * 2, "controller": ["pid"] * 3 + ["smc"] * 3,
            "rmse": np.radians([0.1, 0.2, 0.3, 4.0, 5.0, 90.0]), "failed": [False] * 5 + [True],
            "fate": ["", "", "does not arrive", "", "", "failed"],
        }
    )  # fmt: skip
    stiffness, controller, rmse, *_ = quantities(frame, {"stiffness": "N m/rad", "controller": "1"}, {}).values()
    picture = over_setting(frame, stiffness, [controller], [rmse])
    (panel,) = picture.axes
    drawn = [(line.get_marker(), line.get_linestyle(), np.asarray(line.get_xydata()).tolist()) for line in panel.lines]
    lines = [points for _, style, points in drawn if style == "-"]
    for line, points in zip(lines, [[[1.0, 0.1], [2.0, 0.2], [3.0, 0.3]], [[1.0, 4.0], [2.0, 5.0]]], strict=True):
        assert line == [pytest.approx(point, rel=1e-12) for point in points]
    assert [points for marker, _, points in drawn if marker == "o"] == [[[3.0, pytest.approx(0.3, rel=1e-12)]]]
    assert [points[0][0] for marker, _, points in drawn if marker == "x"] == [3.0]
    assert {text.get_text() for text in picture.legends[0].get_texts()} == {"controller = pid", "controller = smc"}
    named = over_setting(frame, controller, [], [rmse])
    assert [label.get_text() for label in named.axes[0].get_xticklabels()] == ["pid", "smc"]
    assert not [line for line in named.axes[0].lines if line.get_linestyle() == "-"]


def test_angles_that_nobody_could_measure_are_not_shown() -> None:
    frame = pd.DataFrame({"rmse": [1e-9, 1e-8], "oscillation": [1e-12, 1e-9], "steady_state": [1e-9, 1e-3]})
    metrics = list(quantities(frame, {}, {}).values())
    assert [metric.name for metric in headline(frame, metrics)] == ["rmse", "steady_state"]


@pytest.mark.slow
def test_processes_find_what_one_finds(tmp_path: Path) -> None:
    study = swept(wristctl.load_study(None, *FAST), "wrist.stiffness=0.4..0.9:5")
    hashes = {
        done.run.result_hash
        for named in ("serial", "processes:1")
        if (done := wristctl.simulate(study, executor=named, out=tmp_path)).run is not None
    }
    assert len(hashes) == 1


def test_a_point_where_the_wrist_fails_is_told_and_stays_in_the_table() -> None:
    study = wristctl.load_study(None, *FAST, "simulate.gains={Kp: 5.0, Ki: 1.0, Kd: 0.1}", "simulate.horizon=1.0")
    done = wristctl.simulate(swept(study, "wrist.range_deg=31,50", "simulate.loop.plant.payload=0,3"))
    assert done.frame()["failed"].tolist() == [False, True, False, True]
    assert done.frame()["fate"].tolist() == ["", "failed", "", "failed"]
    assert "2 of 4 rollouts: failed" in " ".join(done.summary) and done.marks == ["failed: 2 of 4"]


@pytest.mark.slow
def test_a_sweep_says_of_each_point_what_simulate_says_of_it() -> None:
    """Loops that are sound, chatter, do not arrive, swing and do not converge, to either side."""
    keys = {
        "simulate.controller": ("super-twisting", "feedforward"),
        "simulate.reference.angle_deg": ("-30", "30"),
        "simulate.loop.control_period": ("0.001", "0.005"),
        "simulate.loop.plant.stiffness": ("x1", "x2"),
    }
    base = ("simulate.controller=feedforward", "simulate.gains=default", "wrist.length=0.12", "simulate.horizon=3.0")
    study = wristctl.load_study(None, *base)
    done = wristctl.simulate(swept(study, *(f"{key}={','.join(values)}" for key, values in keys.items())))
    seen = set()
    for row in done.frame().to_dict("records"):
        point = [f"{key}={row[key]}" for key in keys]
        alone = wristctl.simulate(wristctl.load_study(None, *base, *point))
        assert row["fate"] == ", ".join(alone.repeated.marks), point
        seen.update(alone.repeated.marks)
    assert {"chatters", "does not arrive", "limit cycle", "not converged"} <= seen and "" in set(done.frame()["fate"])
    assert any(mark.startswith("chatters: ") for mark in done.marks) and "rollouts: chatters" in str(done)
    assert "fate" in done.tables[0].columns


def test_the_tail_of_a_move_is_no_limit_cycle_in_a_sweep_either() -> None:
    path = "simulate.reference={kind: tip-path, inverse: closed-form}"
    study = wristctl.load_study(None, "simulate.controller=feedforward", "simulate.gains=default", path)
    table = wristctl.simulate(swept(study, "simulate.horizon=5,6")).frame()
    assert table["oscillation"][0] > LIMIT_CYCLE and table["fate"].tolist() == ["", ""]


@pytest.mark.slow
def test_a_search_and_a_comparison_are_done_at_every_point() -> None:
    base = wristctl.load_study(
        None, "tune.controllers=[pd-ff]", "tune.candidates=2", "tune.horizon=0.3",
        "tune.loops={fast: {plant_segments: 1}}", "tune.scenarios=[{loop: fast, reference: {duration: 0.2}}]",
        "compare.controllers=[{controller: pd-ff}]", "compare.loops={fast: {plant_segments: 1}}", "compare.horizon=0.3",
        "compare.references=[{duration: 0.2}]", "compare.inverses=[none]",
    )  # fmt: skip
    tuned = wristctl.tune(swept(base, "tune.iterations=1,4")).frame()
    assert tuned["pd-ff_objective"][1] <= tuned["pd-ff_objective"][0] and "pd-ff_Kp" in tuned
    compared = wristctl.compare(swept(base, "wrist.damping=0.05,0.2")).frame()
    (name,) = [each for each in map(str, compared) if each.startswith("rmse_fast_")]
    assert compared[name].nunique() == 2


@pytest.mark.slow
def test_a_swept_comparison_has_a_row_for_each_controller_and_a_column_for_each_condition() -> None:
    base = wristctl.load_study(
        None, "compare.controllers=[{controller: pd-ff}, {controller: pid-ff}]", "compare.horizon=0.4",
        "compare.loops={exact: {plant_segments: 1}, rig: {actuator: {level: tendon}, plant_segments: 1}}",
        "compare.references=[{duration: 0.2}]", "compare.inverses=[none]",
    )  # fmt: skip
    done: Any = wristctl.compare(swept(base, "wrist.stiffness=0.6,1.2"))
    (shown,), table = done.tables, done.frame()
    heads = [head for head in shown.columns if head.startswith("RMSE")]
    assert heads == ["RMSE, motors [deg]", "RMSE, ideal [deg]"], "what the answer of one leads with is first"
    at_row = [shown.columns.index(head) for head in ("wrist.stiffness [N m/rad]", "controller")]
    rows = [tuple(row[at] for at in at_row) for row in shown.rows]
    assert rows == [(value, name) for value in (0.6, 1.2) for name in ("pd-ff/default", "pid-ff/default")]
    for value in (0.6, 1.2):
        alone: Any = wristctl.compare(
            base.model_copy(update={"wrist": base.wrist.model_copy(update={"stiffness": value})})
        )
        found = table[table["wrist.stiffness"] == value].set_index("controller")
        for ranking in alone.rankings:
            for label in ranking.labels:
                name = f"rmse_{ranking.name.replace(' ', '_')}"
                assert found.loc[label, name] == pytest.approx(ranking.of_label(label).value, rel=1e-12)
        for row in alone.rows:
            (name,) = [each for each in table if str(each).startswith(f"rmse_{row.loop}_none_")]
            assert found.loc[row.label, name] == pytest.approx(row.repeated.metrics["rmse"][0], rel=1e-12)


def test_on_the_screen_a_swept_comparison_has_whole_points() -> None:
    names = [f"c{number}" for number in range(5)]
    frame = pd.DataFrame([(0.1 * k, k, 0, name, 1e-2 * (k + 1)) for k in range(30) for name in names])
    frame.columns = pd.Index(["x", "point", "repetition", "controller", "rmse_a"])
    about = {"rmse_a": {"unit": "rad", "heading": "RMSE, a"}}
    columns = quantities(frame, {"x": ""}, about)
    keys = [columns["x"], columns["controller"]]
    found = answer("compare", frame, keys, [columns["rmse_a"]])
    assert found.table is not None and [row[1] for row in found.table.rows] == names * 2
    assert [row[0] for row in found.table.rows[::5]] == [0.0, pytest.approx(2.9)]
    assert "lowest RMSE, a 0.573 deg at x = 0, controller = c0" in found.sentence
    frame["fate"] = ["swings in a"] + [""] * 149
    assert "; 1 of 150 rows: swings in a." in answer("compare", frame, keys, [columns["rmse_a"]]).sentence


def test_a_sweep_of_what_is_not_there_says_so_before_anything_is_written(tmp_path: Path) -> None:
    study = swept(wristctl.load_study(None, *FAST), "simulate.loop.plant.stifness=1,2")
    with pytest.raises(UserError, match=r"there is no setting simulate.loop.plant.stifness .*did you mean 'stiffness'"):
        wristctl.simulate(study, out=tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("typed", [(), ("simulate.gains=hardware",)])
def test_a_controller_without_the_given_preset_is_swept_with_its_own(typed: tuple[str, ...]) -> None:
    """Gains that are typed hold for those that have them; the others' are as when each is simulated alone."""
    both = "sweep=['simulate.controller=ct-dob,computed-torque']"  # none of which is the study's own
    rows = wristctl.simulate(wristctl.load_study(None, *typed, both)).frame().set_index("simulate.controller")
    for chosen in (("ct-dob", "hardware" if typed else "default"), ("computed-torque", "default")):
        keys = (f"simulate.{key}={value}" for key, value in zip(("controller", "gains"), chosen, strict=True))
        alone = wristctl.simulate(wristctl.load_study(None, *keys))
        assert rows.loc[chosen[0], "rmse"] == pytest.approx(alone.metrics["rmse"], rel=1e-12)


def test_presets_that_are_swept_are_those_of_the_table_or_refused() -> None:
    axes = "sweep=['simulate.controller=ct-dob,computed-torque', 'simulate.gains=hardware,default']"
    with pytest.raises(UserError, match="unknown gains 'hardware' of computed-torque"):
        wristctl.simulate(wristctl.load_study(None, *FAST, axes))


@pytest.mark.parametrize("kind", ["minimum-jerk", pytest.param("dart-thrower", marks=pytest.mark.slow)])
def test_what_speaks_against_a_preset_is_said_once_for_all_points(
    caplog: pytest.LogCaptureFixture, kind: str
) -> None:  # fmt: skip
    axes = "sweep=['simulate.controller=pid,pid-angle', 'wrist.damping=0.05,0.06']"
    loop = ("simulate.loop.actuator.level=tendon", "simulate.gains=printed", f"simulate.reference.kind={kind}")
    study = wristctl.load_study(None, *FAST, *CAMERA, *loop, axes)
    wristctl.simulate(study)
    said = [record.getMessage() for record in caplog.records if "is not made for" in record.getMessage()]
    assert sorted(message.partition(" ")[0] for message in said) == ["pid-angle/printed", "pid/printed"]


@pytest.mark.slow
def test_controllers_that_are_swept_take_their_own_gains_of_one_tuning(tmp_path: Path) -> None:
    base = wristctl.load_study(
        None, *FAST, "simulate.gains=tuned", "tune.controllers=[pid-ff,ct-dob]", "tune.candidates=2",
        "tune.iterations=1", "tune.horizon=0.3", "tune.loops={fast: {plant_segments: 1}}",
        "tune.scenarios=[{loop: fast, reference: {duration: 0.2}}]",
    )  # fmt: skip
    tuned = wristctl.tune(base, out=tmp_path)
    study = swept(base, "simulate.controller=pid-ff,ct-dob")
    rows = wristctl.simulate(study, tuned=tuned).frame().set_index("simulate.controller")["rmse"]
    for name in ("pid-ff", "ct-dob"):
        gains = ",".join(f"{gain}={value!r}" for gain, value in tuned.gains[name].items())
        alone = at(f"simulate.controller={name}", f"simulate.gains={gains}").metrics["rmse"]
        assert rows[name] == pytest.approx(alone, rel=1e-12)
    with pytest.raises(UserError, match="no tuned gains of smc"):
        wristctl.simulate(swept(base, "simulate.controller=pid-ff,smc"), tuned=tuned)


CIRCLE = (
    "simulate.reference={kind: circumduction, angle_deg: 20, duration: 0.4}", "simulate.horizon=0.8",
    "simulate.loop.plant_segments=1", "simulate.controller=pid-ff", "simulate.gains=hardware",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "values", "others"),
    [
        ("wrist.stiffness", ("0.8", "1.4"), ("wrist.tendons=three",)),
        ("wrist.tendons", ("three", "four"), ()),
        ("wrist.tendon_radius", ("0.015", "0.02"), ("wrist.tendons=three", "simulate.loop.sensor.level=camera")),
        ("simulate.loop.plant.stiffness_spread", ("0.1", "0.3"), ("simulate.repetitions=2",)),
        ("simulate.loop.plant.actuator.broken_tendon", ("1", "3"), ("simulate.loop.plant.actuator.broken_at=0.3",)),
    ],
)
def test_a_point_in_two_planes_is_the_rollout_that_simulate_makes_there(
    key: str, values: tuple[str, str], others: tuple[str, ...]
) -> None:
    study = wristctl.load_study(None, *CIRCLE, *others)
    table = wristctl.simulate(swept(study, f"{key}={','.join(values)}")).frame()
    for number, value in enumerate(values):
        alone = wristctl.simulate(wristctl.load_study(None, *CIRCLE, *others, f"{key}={value}"))
        rows = table[table["point"] == number]
        for name in ("rmse", "rmse_ulnar", "rmse_flexion", "largest_error", "chattering", "oscillation", "energy"):
            found = alone.repeated.metrics[name].tolist()
            assert rows[name].to_list() == pytest.approx(found, rel=1e-12, nan_ok=True), name
        assert rows["failed"].to_list() == alone.repeated.failed.tolist()
        marks = [mark for mark in alone.marks if mark != "does not arrive"]  # of a motion that rests, in a sweep
        assert set(rows["fate"]) == {", ".join(marks)}


@pytest.mark.slow
def test_points_of_one_plane_and_of_two_stand_in_one_table() -> None:
    """What lies aside of the motion's plane takes only its own points out of it."""
    study = wristctl.load_study(None, *FAST)
    table = wristctl.simulate(swept(study, "wrist.gravity_flexion=0,9.81", "wrist.tendons=four,five")).frame()
    aside = table["wrist.gravity_flexion"] > 0.0
    assert table["rmse_flexion"].isna().to_list() == (~aside).to_list() and table["rmse"].notna().all()
    for gravity in ("0", "9.81"):
        alone = at(f"wrist.gravity_flexion={gravity}").repeated.metrics["rmse"]
        here = table[(table["wrist.gravity_flexion"] == float(gravity)) & (table["wrist.tendons"] == "four")]
        assert here["rmse"].to_list() == pytest.approx(alone.tolist(), rel=1e-12)
