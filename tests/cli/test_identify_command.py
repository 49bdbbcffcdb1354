"""`wristctl identify` on logged runs, and what other commands make of its result."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.identification.benches import KNOWN, LEVEL, SLOW, UPRIGHT, write_run
from wristctl.config.loop import DirectionName, Loop
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.identification.unknowns import identified_yaml, with_identified
from wristctl.records import open_run, start_run
from wristctl.simulation.closed_loop import simulate
from wristctl.study_files.load import load_study

SIDES: tuple[DirectionName, ...] = ("ulnar", "extension")


@pytest.mark.painted
@pytest.mark.slow
def test_two_poses_give_a_run_that_simulate_starts_from(call: Call, tmp_path: Path) -> None:
    poses = [write_run(tmp_path / "results", 0, pose, sides=SIDES) for pose in (UPRIGHT, LEVEL)]
    code, out, err = call("identify", *(run.id for run in poses), "--set", "fix.friction=0.1")
    assert code == 0, err
    found = open_run(out.splitlines()[-1])
    assert [each.run for each in found.manifest.inputs] == [run.id for run in poses]
    table = found.data("parameters").set_index("parameter")
    assert table.value["stiffness"] == pytest.approx(0.7 * KNOWN.stiffness, rel=0.1)
    assert table.low["stiffness"] < table.value["stiffness"] < table.high["stiffness"] < KNOWN.stiffness
    assert (table.verdict["friction"], table.value["friction"]) == ("fixed", 0.1)
    assert found.metrics["stiffness"]["interval"] == [table.low["stiffness"], table.high["stiffness"]]
    assert found.metrics["condition"]["value"] > 1.0
    lines = out.splitlines()
    shown = {line.split()[0]: line for line in lines if line.split()[:1] and line.split()[0] in table.index}
    assert list(shown) == list(table.index) and len(lines) <= 34
    assert all(len(line) <= 100 for line in lines if str(found.path.name) not in line)
    assert f"{table.value['stiffness']:.4g}" in shown["stiffness"] and " N m/rad " in shown["stiffness"]
    assert f"{table.low['stiffness']:.4g} to {table.high['stiffness']:.4g}" in shown["stiffness"]
    assert "fixed" in shown["friction"] and "fixed" not in shown["stiffness"]
    pasted = load_study([found.file("data/identified.yaml")])
    assert pasted.wrist.damping == table.value["damping"]
    family = load_study([found.file("data/posterior.yaml")]).families["posterior"]
    drawn = np.array([row["plant.stiffness"] for row in family.together])
    low, high = table.low["stiffness"], table.high["stiffness"]
    assert len(drawn) == 200 and 0.88 < np.mean((low < drawn) & (drawn < high)) < 0.995
    sensor = pasted.simulate.loop.sensor
    assert sensor.frame_rate == pytest.approx(60.0, rel=1e-6) and sensor.dropped == pytest.approx(0.05, abs=0.03)
    assert sensor.delay_frames == pytest.approx(60.0 * (0.01 + 0.03), abs=0.1)

    code, out, err = call("simulate", "--from-identified", "latest:identify")
    assert code == 0, err
    replaced = open_run(out.splitlines()[-1])
    assert [(each.role, each.run) for each in replaced.manifest.inputs] == [("from_identified", found.id)]
    expected = simulate(Study(wrist=pasted.wrist))
    assert replaced.metrics["rmse"]["value"] == expected.metrics["rmse"]
    for text in (out, *((replaced.path / name).read_text() for name in ("README.md", "report.html"))):
        words = " ".join(text.split())
        assert f"the wrist identified in {found.id}" in words and "the paper's wrist" not in words


@pytest.mark.slow
def test_commands_say_whose_wrist_they_took_and_hand_it_on_in_what_they_advise(call: Call, tmp_path: Path) -> None:
    wrist = {"stiffness": 0.4, "flexion_ratio": 1.1, "damping": 0.09, "tendon_radius": 0.021}
    values = wrist | {"tendon_stiffness": 9e3, "friction": 0.2, "presliding": 3e-5, "sheath_friction": 0.3}
    with start_run("identify", Study(), out=tmp_path / "results") as run:
        path = run.file("data/identified.yaml")
        path.parent.mkdir(exist_ok=True)
        path.write_text(identified_yaml(values, {"frame_rate": 30.0, "delay_frames": 1.5}))
    takes = ("--from-identified", run.id)
    code, out, err = call("simulate", *takes, "--controller", "pd-ff", "--reference", "circle")
    assert code == 0, err
    assert f"the wrist identified in {run.id} in two planes" in " ".join(out.split())
    short = ("--set", "simulate.horizon=0.06", "--set", "simulate.reference.duration=0.05")  # where nothing arrives
    code, out, err = call("simulate", *takes, "--controller", "pd-ff", *short)
    advised = next(line for line in out.splitlines() if line.startswith("wristctl tune "))
    search_here = load_study([Path(shlex.split(advised)[-1])])
    assert code == 0 and search_here.wrist.stiffness == 0.4 and search_here.tune.controllers == ("pd-ff",)
    assert [loop.actuator.tendon_stiffness for loop in search_here.tune.loops.values()] == [9e3]
    search = ("tune.controllers=[pd-ff]", "tune.iterations=1", "tune.candidates=2")
    code, out, err = call("tune", *takes, *(word for key in search for word in ("--set", key)))
    advised = next(line for line in out.splitlines() if line.startswith("wristctl simulate "))
    once = load_study([Path(shlex.split(advised)[-1])])
    assert code == 0 and once.wrist.stiffness == 0.4 and once.simulate.loop.actuator.tendon_stiffness == 9e3
    assert "the paper's wrist" in " ".join(call("simulate")[1].split())


@pytest.mark.slow
def test_what_cannot_be_told_apart_is_refused_with_what_to_add(call: Call, tmp_path: Path) -> None:
    run = write_run(tmp_path / "results", 1, UPRIGHT, SLOW, sides=("ulnar",))
    code, out, err = call("identify", run.id)
    refused = next(line for line in err.splitlines() if line.startswith("error:"))
    assert code == 3 and "damping" in refused and "add " in err and "--set fix." in err
    assert "condition number" in err and out == "" and len(err.splitlines()) < 35
    told = next(line for line in err.splitlines() if line.startswith("damping "))
    within, asked, with_more = (float(text) for text in re.findall(r"([\d.]+) %", told))
    assert within > asked > with_more
    typed = [line for line in err.splitlines() if line.startswith("wristctl hw-run ")]
    assert len(typed) == 2
    masses = []
    for line in typed:
        code, out, _ = call(*shlex.split(line)[1:], "--dry-run")
        assert code == 0 and "multi-step" in out
        masses += re.findall(r"hand_mass: ([\d.]+)", out)
    assert masses == ["0.1"], "the other hand, and the one that is"
    failed = open_run(next((tmp_path / "results").glob("*-identify-*")))
    assert failed.state == "failed" and failed.manifest.exit_code == 3
    assert set(failed.data("parameters").verdict) >= {"not identified"}
    assert "condition number of the Jacobian" in (failed.path / "README.md").read_text()
    assert not (failed.path / "data/identified.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "identify needs a hw-run run or a log - identify.runs - fix: latest:hw-run"),
        ((), "a log's file: my.csv, or --set logs=[my.csv]"),
        (("nothing",), "no such run"),
        (("--set", "fix.damping=1.0"), "needs a hw-run"),
        (("--set", "fix.dampin=1.0"), "did you mean 'damping'"),
    ],
)
def test_without_logged_runs_there_is_nothing_to_identify(call: Call, arguments: tuple[str, ...], said: str) -> None:
    code, _, err = call("identify", *arguments)
    assert code == 2 and said in err


def test_a_study_among_the_logs_is_told_where_it_goes(call: Call, tmp_path: Path) -> None:
    (tmp_path / "my.yaml").write_text("wrist:\n  stiffness: 0.4\n")
    code, _, err = call("identify", str(tmp_path / "my.yaml"))
    assert code == 2 and "a study file" in err and f"`wristctl identify my.csv --config {tmp_path}/my.yaml`" in err


def test_identified_values_replace_what_a_command_knows_and_leave_its_levels() -> None:
    wrist = {"stiffness": 0.4, "flexion_ratio": 1.1, "damping": 0.09, "tendon_radius": 0.021}
    tendons = {"tendon_stiffness": 9e3, "friction": 0.2, "presliding": 3e-5}
    values = wrist | tendons | {"sheath_friction": 0.3}
    text = identified_yaml(values, {"frame_rate": 30.0, "delay_frames": 1.5})
    study = Study(simulate={"loop": Loop(actuator=Actuator(level="tendon"))})  # type: ignore[arg-type]
    simulated = with_identified(study, "simulate", text)
    assert simulated.wrist == study.wrist.model_copy(update=wrist)
    assert simulated.simulate.loop.actuator == Actuator(level="tendon", sheath=0.3 / 0.2).model_copy(update=tendons)
    tuned = with_identified(study, "tune", text).tune
    assert {loop.sensor.delay_frames for loop in tuned.loops.values()} == {1.5}
    levels = {name: loop.sensor.level for name, loop in study.tune.loops.items()}
    assert {name: loop.sensor.level for name, loop in tuned.loops.items()} == levels


def _log_of(file: Path, noise: float, unlike: bool = False, step: float = 0.02) -> None:
    """An open log of a wrist in one plane that follows its spools 40 ms late, or that has a motion of its own."""
    time = np.arange(0.0, 8.0, step)
    bend = 20.0 * np.sin(1.5 * time) * np.minimum(1.0, time)
    late = np.interp(time - 0.04, time, bend) + noise * np.random.default_rng(0).normal(size=len(time))
    spool = 14.142 * np.radians(20.0 * np.sin(2.3 * time) if unlike else bend)
    rows = [f"{t:.3f},{s:.5f},{-s:.5f},{b:.4f}" for t, s, b in zip(time, spool, late, strict=True)]
    file.write_text("\n".join(["time [s],spool_1 [mm],spool_2 [mm],bend_y [deg]", *rows]) + "\n")


@pytest.mark.painted
@pytest.mark.slow
def test_an_open_log_tells_what_it_can_in_a_run_of_its_own(call: Call, tmp_path: Path) -> None:
    _log_of(tmp_path / "my.csv", 0.05, step=0.005)
    code, out, err = call("identify", str(tmp_path / "my.csv"))
    assert code == 0, err
    assert (
        out.startswith("Identified: ")
        and "delay" in out.split(".")[0]
        and "Stiffness in N m/rad is not identifiable" in out
    )
    found = open_run(out.splitlines()[-1])
    delay = found.metrics["delay"]
    assert delay["interval"][0] - 2e-3 < 0.04 < delay["interval"][1] + 2e-3
    assert found.metrics["tendon"]["value"] is None and found.metrics["error"]["value"] < 0.1
    assert "Of 1600 samples the models are fitted at 801 instants" in " ".join(out.split())
    to_paste = [line for line in out.splitlines() if line.startswith("wristctl recommend ")]
    assert len(to_paste) == 1 and to_paste[0].endswith("--set wrist.stiffness=VALUE")
    assert "not identifiable" in out
    assert all(len(line) <= 100 for line in out.splitlines()[:-1] if line not in to_paste)
    (tmp_path / "my.csv").unlink()
    assert call("runs", "verify", found.id)[0] == 0
    assert call("runs", "replay", found.id)[0] == 0


@pytest.mark.slow
def test_a_log_that_no_model_predicts_is_refused_with_its_answer(call: Call, tmp_path: Path) -> None:
    _log_of(tmp_path / "back.csv", 0.05, unlike=True)
    code, out, err = call("identify", str(tmp_path / "back.csv"))
    assert code == 3 and out == "" and "nothing of it is to be relied on" in err and "misfit=tell" in err
    failed = open_run(next((tmp_path / "results").glob("*-identify-*")))
    assert failed.state == "failed" and "not identifiable" in (failed.path / "README.md").read_text()
    code, out, err = call("identify", str(tmp_path / "back.csv"), "--dry-run")
    assert code == 0 and "400 samples" in out and "instants" not in out
