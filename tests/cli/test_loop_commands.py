"""`simulate`, `tune` and `compare` as they are typed."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.cli.conftest import Call
from wristctl.records import Run, list_runs, open_run
from wristctl.seeds import stream

LOOP = ("--set", "loops={fast: {plant_segments: 1}}", "--set", "horizon=0.5")
MOVE = "{kind: minimum-jerk, duration: 0.3, angle_deg: %s}"
TUNE = (
    "tune", *LOOP, "--candidates", "4", "--iterations", "3", "--set", "controllers=[smc, pid]",
    "--set", f"scenarios=[{{loop: fast, reference: {MOVE % 20}}}]",
)  # fmt: skip
COMPARE = (
    "compare", *LOOP, "--set", "inverses=[none, closed-form]", "--set", f"references=[{MOVE % 30}, {{kind: step}}]",
    "--set", "controllers=[{controller: smc, gains: exchanged}, {controller: computed-torque, gains: default}]",
)  # fmt: skip


@pytest.mark.painted
@pytest.mark.slow
def test_simulate_leaves_a_trajectory_metrics_and_pictures(call: Call) -> None:
    code, out, _ = call("simulate", "--controller", "computed-torque", "--gains", "default")
    run = open_run("latest:simulate")
    course = run.data("trajectory")
    assert code == 0 and out.splitlines()[-1].endswith(run.id)
    assert run.metrics["rmse"]["value"] < 1e-4 and run.metrics["rmse"]["unit"] == "rad"
    assert course["theta"].iloc[-1] == pytest.approx(0.5236, abs=1e-3)
    parts = course[[f"theta_{k}" for k in range(1, 5)]].sum(axis=1)
    assert parts.to_numpy() == pytest.approx(course["theta"], abs=1e-15)
    drawn = {file.name for file in (run.path / "figures").iterdir()}
    assert drawn == {"course.png", "course.svg"}, "the rest is drawn when it is asked for"


def test_the_tuning_that_is_advised_is_of_the_users_own_wrist(call: Call, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("wrist: {length: 0.1}\n")
    typed = ("--controller", "pid-ff", "--set", "loop.plant_segments=1", "--set", "wrist.stiffness=0.7", "--seed", "4")
    code, out, _ = call("simulate", "mine.yaml", *typed, "--set", "horizon=0.02", "--set", "reference.kind=step")
    assert code == 0
    line = next(each for each in out.splitlines() if "wristctl tune" in each)
    words = shlex.split(line[line.index("wristctl tune") :])
    code, out, _ = call(*words[1:], "--dry-run", "--json")
    shown = yaml.safe_load(json.loads(out)["config"])
    assert code == 0 and "pid-ff" in shown["tune"]["controllers"] and shown["seed"] == 4
    assert (shown["wrist"]["length"], shown["wrist"]["stiffness"]) == (0.1, 0.7)


@pytest.mark.painted
@pytest.mark.slow
def test_analyse_takes_the_loop_of_simulate_and_begins_with_its_margins(call: Call) -> None:
    typed = ("--controller", "pid", "--set", "gains={Kp: 10.0, Ki: 20.0, Kd: 0.5}", "--over", "Kp")
    code, out, _ = call("analyse", *typed, "--set", "loop.control_period=2e-3", "--set", "angles_deg=[20.0]")
    run = open_run("latest:analyse")
    assert code == 0 and out.startswith("pid/given is stable at 20 deg")
    assert f"delay margin {1e3 * run.metrics['delay_margin']['value']:.3g} ms" in out
    assert run.config.simulate.loop.control_period == 2e-3 and run.config.analyse.over == "Kp"
    delay = run.metrics["delay_margin"]
    assert 5e-3 < delay["value"] < 15e-3 and delay["unit"] == "s"
    config = str(run.path / "config.yaml")
    assert call("analyse", "-c", config)[0] == 0 and open_run("latest:analyse").result_hash == run.result_hash
    assert call("analyse", "--gains", "exchanged", "-q", "--set", "angles_deg=[0.0]", "--set", "horizon=0.1")[0] == 3


@pytest.fixture(scope="module")
def tuning(made: Callable[..., Path]) -> Path:
    """A folder with a tune run."""
    return made(*TUNE)


@pytest.fixture(scope="module")
def comparison(made: Callable[..., Path]) -> Path:
    """A folder with a compare run."""
    return made(*COMPARE)


@pytest.fixture
def tuned_before(call: Call, tuning: Path, tmp_path: Path) -> None:
    """The tune run in the folder of this test."""
    shutil.copytree(tuning / "results", tmp_path / "results")


@pytest.mark.painted
@pytest.mark.usefixtures("tuned_before")
@pytest.mark.slow
def test_tuned_gains_reach_compare_and_simulate(call: Call) -> None:
    tuned = open_run("latest:tune")
    gains = json.loads(tuned.file("data/gains.json").read_text())
    history = tuned.data("history-smc")
    best = tuned.data("finalists-smc").iloc[0]
    assert {name: best[name] for name in gains["smc"]} == gains["smc"] and len(history) == 12
    assert best["objective"] == best["validated"] <= history["objective"].min()  # nothing is random here
    code, out, _ = call(*COMPARE, "--set", "controllers=[{controller: pid, gains: tuned}]", "--tuned", "latest:tune")
    assert code == 0 and "use pid/tuned" in out
    compared = open_run("latest:compare")
    assert [entry["run"] for entry in compared.manifest.model_dump()["inputs"]] == [tuned.id]
    assert call("simulate", "--gains", "tuned", "--tuned", tuned.id, "--set", "horizon=0.5")[0] == 0
    call("analyse", "--gains", "tuned", "--tuned", "latest:tune", "--set", "horizon=0.5")
    analysed = open_run(max(Path("results").glob("*-analyse-*")))
    assert [each.run for each in analysed.manifest.inputs] == [tuned.id] == [analysed.config.simulate.tuned]


def test_compare_has_a_row_for_every_combination_and_the_papers_numbers_beside(comparison: Path) -> None:
    run = open_run("latest:compare", comparison / "results")
    table, said = run.data("comparison"), (run.path / "console.log").read_text()
    assert "0.00027 / 1.2 / 0.000231" in said and "Control step" in said
    assert len(table) == 8 and set(table["loop"]) == {"fast"}
    smc, ours = table[table["controller"] == "smc"], table[table["controller"] == "computed-torque"]
    assert (smc["paper_rmse"] == 2.7e-4).all() and ours["paper_rmse"].isna().all()
    assert (table["inverse"].tolist() == ["none", "closed-form"] * 4) and not table["failed"].any()


@pytest.mark.slow
def test_the_same_command_and_seed_give_the_same_result(call: Call, tuning: Path, comparison: Path) -> None:
    for before, command in ((tuning, TUNE), (comparison, COMPARE)):
        (run,) = list_runs(before / "results")
        assert json.loads(call(*command, "--json")[1])["result_sha256"] == run.result_hash


@pytest.mark.usefixtures("tuned_before")
def test_gains_tuned_on_what_they_would_be_judged_on_are_refused(call: Call) -> None:
    code, _, said = call(*COMPARE, "--set", f"references=[{MOVE % 20}]", "--tuned", "latest:tune")
    assert code == 2 and "tuned on a scenario" in said
    assert {run.kind for run in list_runs(Path("results"))} == {"tune"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("simulate", "--controller", "scm"), "did you mean 'smc'?"),
        (("simulate", "--gains", "exchangd"), "did you mean 'exchanged'?"),
        (("simulate", "--set", "reference.angle_deg=80"), "beyond the wrist's range"),
        (("simulate", "--set", "reference.inverse=network"), "--network RUN"),
        (("simulate", "--set", "start=equilibrium", "--set", "wrist.hand_mass=0.9"), "the wrist buckles"),
        (("simulate", "--tuned", "nowhere"), "nowhere"),
        (("analyse", "--controller", "pid", "--gains", "printed", "--over", "Kx"), "one of Kd, Ki, Kp, loop"),
        (("analyse", "--controller", "scm"), "did you mean 'smc'?"),
        (("analyse", "--set", "angels_deg=[1.0]"), "did you mean 'angles_deg'?"),
        (("analyse", "--set", "horizn=1.0"), "did you mean 'horizon'?"),
        (("analyse", "--gains", "initial", "--set", "wrist.tension_limit=3.0"), "in a tendon that bears 3"),
        (("tune", "--set", "controllers=[feedforward]"), "no gains to tune"),
        (("tune", "--set", "optimiser=differential-evolution", "--candidates", "2"), "at least 3 candidates, not 2"),
        (("tune", "--set", "scenarios=[{loop: four-segmets}]"), "did you mean 'four-segments'?"),
        (("compare", "--set", "controllers=[{controller: pdi, gains: printed}]"), "did you mean 'pid'?"),
        (("compare", "--set", "inverses=[network]"), "--network RUN"),
    ],
)
@pytest.mark.slow
def test_what_the_user_got_wrong_is_one_line_and_no_run_that_looks_complete(
    call: Call, arguments: tuple[str, ...], said: str
) -> None:
    code, _, err = call(*arguments)
    lines = [line for line in err.splitlines() if line.startswith("error:")]
    assert code == 2 and len(lines) == 1 and said in lines[0] and "Traceback" not in err
    assert all(run.state == "failed" for run in list_runs(Path("results")))


@pytest.mark.parametrize("command", ["simulate", "analyse", "compare", "hw-run"])
def test_tuned_gains_of_no_run_are_refused_before_anything_is_written(call: Call, tmp_path: Path, command: str) -> None:
    rows = (
        ("--gains", "tuned")
        if command in ("simulate", "analyse")
        else ("--set", "controllers=[{controller: smc, gains: tuned}]")
    )
    code, _, err = call(command, *rows)
    assert code == 2 and "no tuned gains of smc" in err and "--tuned RUN" in err and not list(tmp_path.iterdir())


CAMERA = ("--set", "repetitions=8", "--set")


@pytest.mark.slow
def test_repetitions_give_medians_with_intervals_in_tables_metrics_and_data(call: Call) -> None:
    loop = "loop={plant_segments: 1, sensor: {level: camera}}"
    code, out, _ = call("simulate", "--set", "horizon=0.3", *CAMERA, loop, "--set", "reference.duration=0.2")
    run = open_run("latest:simulate")
    every, known = run.data("repetitions"), run.metrics["rmse"]
    assert code == 0 and "8 repetitions" in out and re.search(r"figure +median of 8 +95 % low +95 % high", out)
    assert len(every) == 8 and every["rmse"].nunique() == 8
    assert known["value"] == pytest.approx(every["rmse"].median()) and known["n"] == 8
    low, high = known["interval"]
    assert every["rmse"].min() <= low < known["value"] < high <= every["rmse"].max()

    rows = "controllers=[{controller: smc-tracking, gains: camera}]"
    code, out, _ = call("compare", "--horizon", "0.3", *CAMERA, f"loops={{seen: {{{loop[6:]}}}", "--set", rows,
                        "--set", "references=[{duration: 0.2}]", "--set", "inverses=[none]", "--all")  # fmt: skip
    run = open_run("latest:compare")
    (row,), every = run.data("comparison").to_dict("records"), run.data("repetitions")
    assert code == 0 and "medians of 8 repetitions" in out and "RMSE's 95 % low" in out
    assert row["repetitions"] == len(every) == 8 and row["rmse"] == pytest.approx(every["rmse"].median())
    assert row["rmse_low"] < row["rmse"] < row["rmse_high"]
    (known,) = (each for name, each in run.metrics.items() if name.startswith("rmse_seen"))
    assert (known["value"], known["interval"]) == (row["rmse"], [row["rmse_low"], row["rmse_high"]])


def test_a_buckling_wrist_is_a_warning_and_a_mark_in_the_manifest(call: Call) -> None:
    code, _, err = call("simulate", "--set", "wrist.hand_mass=0.8", "--set", "horizon=0.1")
    assert code == 0 and "warning: the straight wrist buckles" in err
    assert open_run("latest:simulate").manifest.model_dump()["numerics"]["buckles"] is True


def begun_tuning(folder: Path) -> subprocess.Popen[bytes]:
    """A tuning of hours, with its first iterations done."""
    code = "import sys; from wristctl.cli.app import main; main()"
    arguments = ["tune", "--iterations", "100000", "--candidates", "8", "--set", "loops={fast: {plant_segments: 1}}"]
    arguments += ["--set", "scenarios=[{loop: fast}]"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-c", code, *arguments]
    child = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, env=environment)
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and child.poll() is None:
        events = list(folder.glob("results/*/events.jsonl"))
        if events and '"progress"' in events[0].read_text():
            return child
        time.sleep(0.05)
    raise AssertionError(f"no progress: {child.poll()}")


@pytest.mark.slow
def test_a_killed_tuning_reads_as_crashed(tmp_path: Path) -> None:
    child = begun_tuning(tmp_path)
    child.kill()
    child.communicate()
    (run,) = list_runs(tmp_path / "results")
    assert run.state == "crashed"


@pytest.mark.slow
def test_an_interrupted_tuning_keeps_what_it_found(tmp_path: Path) -> None:
    child = begun_tuning(tmp_path)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    (run,) = list_runs(tmp_path / "results")
    assert child.returncode == 130 and run.state == "interrupted" and b"Traceback" not in said
    assert set(json.loads(run.file("data/gains.json").read_text())["smc"]) == {"P1", "P2", "P3"}
    assert len(run.data("history-smc")) >= 8 and (run.path / "SHA256SUMS").exists()


@pytest.mark.slow
def test_a_run_names_the_streams_that_it_drew_from(call: Call) -> None:
    seen = "{plant_segments: 1, sensor: {level: camera}}"
    call("simulate", "--seed", "3", "--set", "horizon=0.1", "--set", f"loop={seen}", "--set", "reference.kind=step")
    name = "judged camera: step 30 deg, ulnar"
    assert open_run("latest:simulate").manifest.streams == {name: stream(3, name)}
    call("compare", "--horizon", "0.1", "--set", "loops={a: {plant_segments: 1, plant: {stiffness_spread: 0.1}}}",
         "--set", "controllers=[{controller: smc, gains: exchanged}]", "--set", "inverses=[none]")  # fmt: skip
    assert set(open_run("latest:compare").manifest.streams) == {"judged plant"}
    call("tune", "--set", "controllers=[smc]", "--set", "horizon=0.1", "--set", "candidates=2", "--set", "iterations=1",
         "--set", f"loops={{four-segments: {seen}}}")  # fmt: skip
    drawn = open_run("latest:tune").manifest.streams
    assert "search smc" in drawn and any(each.startswith("tuning camera: ") for each in drawn)


@pytest.mark.slow
def test_simulate_exits_3_where_the_wrist_left_its_range_and_its_run_stands(call: Call) -> None:
    """Pushed by more than any tendon holds."""
    settings = ("simulate.loop={disturbances: {push: {force: 100.0, duration: 0.5}}}",)
    code, out, err = call("simulate", *(part for each in settings for part in ("--set", each)))
    run = Run(Path(out.splitlines()[-1]))
    assert (
        code == 3
        and "the wrist left its range at" in err
        and "fails: the wrist left its range at" in " ".join(out.split())
    )
    assert run.state == "ok" and run.manifest.exit_code == 3 and run.problems() == []
    assert "FAILED: left its range at" in run.file("README.md").read_text()


SOFT = (
    "--set", "families={soft: {about: springs, loop: {plant_segments: 1}, draw: {plant.stiffness: x0.8..1.4},"
    " references: [{duration: 0.3}], horizon: 2.4}}",
)  # fmt: skip
SEARCH = ("tune", *SOFT, "--candidates", "4", "--iterations", "3", "--set", "controllers=[ct-dob]",
          "--set", "restarts=2", "--set", "worlds={family: soft, draws: 2, validation: 3}")  # fmt: skip


@pytest.mark.painted
@pytest.mark.slow
def test_gains_are_searched_on_worlds_and_rows_ranked_on_others_with_the_answer_first(call: Call) -> None:
    code, out, err = call(*SEARCH)
    assert code == 0, err
    tuned = open_run("latest:tune")
    assert all(
        f"{gain} = {value:.4g}" in out
        for gain, value in json.loads(tuned.file("data/gains.json").read_text())["ct-dob"].items()
    )
    assert len(tuned.data("history-ct-dob")) == 24 and tuned.config.families["soft"].about == "springs"
    rows = "controllers=[{controller: ct-dob, gains: tuned}, {controller: pd-ff}]"
    code, out, err = call(
        "compare", *SOFT, "--set", "worlds={family: soft, draws: 12}", "--set", rows, "--tuned", tuned.id
    )
    assert code == 0, err
    of = {line.split()[0]: line for line in out.splitlines() if line.startswith(("ct-dob/tuned ", "pd-ff/default "))}
    assert len(of) == 2 and "*" in of["ct-dob/tuned"] and "*" not in of["pd-ff/default"]
    assert "use ct-dob/tuned" in out.splitlines()[0]
    run = open_run("latest:compare")
    assert (run.path / "README.md").read_text().index("use ct-dob/tuned") < 2000
    assert run.problems() == [] and len(run.data("worlds")) == 3 * 12
    ranking = run.data("ranking")
    assert ranking["row"].tolist() == ["ct-dob/tuned", "pd-ff/default", "feedforward/default"]
    assert ranking["group"].tolist() == [1, 2, 3]
    code, _, _ = call("compare", "-c", str(run.path / "config.yaml"))
    assert code == 0 and open_run("latest:compare").result_hash == run.result_hash


@pytest.mark.slow
def test_smooth_motions_and_steps_of_a_family_are_ranked_in_tables_of_their_own(call: Call) -> None:
    """A step's error is that of the jump: no mean is of both, and no table has a row twice."""
    both = SOFT[1].replace("{duration: 0.3}", "{kind: step}, {duration: 0.3}")
    assert both != SOFT[1]
    rows = "controllers=[pd-ff, ct-dob]"
    code, _, err = call("compare", "--set", both, "--set", "worlds={family: soft, draws: 8}", "--set", rows)
    assert code == 0, err
    run = open_run("latest:compare")
    smooth, steps = (run.data(name).set_index("row")["rmse"] for name in ("ranking", "ranking-steps"))
    assert sorted(smooth.index) == sorted(steps.index) == ["ct-dob/default", "feedforward/default", "pd-ff/default"]
    assert smooth["ct-dob/default"] < 0.1 * steps["ct-dob/default"]


@pytest.mark.slow
def test_a_search_that_was_cut_short_goes_on_in_a_new_run_to_the_same_result(call: Call) -> None:
    assert call(*SEARCH)[0] == 0
    whole = open_run("latest:tune")
    short = ["1" if each == "3" else each for each in SEARCH]
    assert call(*short)[0] == 0
    code, _, err = call(*SEARCH, "--set", f"resume={open_run('latest:tune').id}")
    assert code == 2 and "tried other gains of ct-dob in iteration 1" in err  # its second search began there
    assert call(*short, "--set", "restarts=1")[0] == 0
    begun = open_run("latest:tune")
    code, _, err = call(*SEARCH, "--set", f"resume={begun.id}")
    assert code == 0, err
    again = open_run("latest:tune")
    assert [(each.role, each.run) for each in again.manifest.inputs] == [("resume", begun.id)]
    for name in ("history-ct-dob.csv", "finalists-ct-dob.csv", "gains.json"):
        assert again.file(f"data/{name}").read_bytes() == whole.file(f"data/{name}").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("compare", *SOFT, "--set", "worlds.family=sof"), "did you mean 'soft'"),
        (("tune", "--set", "worlds.family=camera"), "experiments/scenarios has some"),
        (("tune", "--set", "families={odd: {draw: {plant.stiffnes: x0.5..2}}}"), "there is no such leaf"),
        (("compare", *SOFT, "--set", "worlds={family: soft, split: sealed}"), "split: sealed goes with its seed"),
    ],
)
def test_worlds_that_cannot_be_drawn_are_said(call: Call, arguments: tuple[str, ...], said: str) -> None:
    code, _, err = call(*arguments)
    assert code == 2 and said in err and not list(Path("results").glob("*"))


def test_where_every_law_fails_or_swings_the_answer_says_so_and_the_table_stays(call: Call) -> None:
    wild = "families={wild: {loop: {disturbances: {load: 30.0}}, horizon: 1.5}}"
    rows = "controllers=[{controller: pd-ff}, {controller: feedforward}]"
    hard = ("--set", wild, "--set", "worlds={family: wild, draws: 8}", "--set", rows)
    code, out, _ = call("compare", *hard)
    assert "use none of these" in out and "Do not use: in wild pd-ff and feedforward." in out
    assert out.count("fails in 8 of 8") == 2
    assert code == 3
