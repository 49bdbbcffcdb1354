"""`wristctl identify` on logs in two planes, and what `simulate` makes of its result."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.identification.bend_rigs import KNOWN, TENDONS, drawn_rig, logs_of
from wristctl.commands.identify.bends import what_tells
from wristctl.config.identify import IdentifySettings
from wristctl.config.loop import Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import Told
from wristctl.identification.bend_estimates import forces_are_scaled, without_forces
from wristctl.identification.measured_trials import places_of_log, trials_of_logs
from wristctl.identification.problem import bend_problem
from wristctl.identification.unknowns import with_identified
from wristctl.records import open_run
from wristctl.records.open_log import OpenLog, write_log
from wristctl.study_files.load import load_study
from wristctl.wrist.tendon_layout import TendonLayout


@pytest.mark.slow
def test_what_would_tell_more_is_what_the_logs_have_not() -> None:
    rng = np.random.default_rng(1)
    rig = drawn_rig(rng)
    logs = logs_of(rig, rng)
    assert len({float(log.columns["mass"][0]) for log in logs}) > 1

    def said(used: list[OpenLog], *lacking: str) -> str:
        trials = trials_of_logs(used, KNOWN, 1e-3)
        fit: Any = SimpleNamespace(problem=SimpleNamespace(trials=trials))
        return what_tells(fit, lacking)

    assert "mass" not in said(logs, "stiffness") and "slack" in said(logs, "stiffness")
    assert "another mass" in said(logs[:1], "stiffness_across")
    assert said(logs, "gain_1", "direction_2") == ""
    assert "mass" not in said(logs[:1], "delay") and "Quicker moves" in said(logs[:1], "delay")
    assert "both ulnar and flexion" not in said(logs, "stiffness_across")
    flat = [replace(log, columns={**log.columns, "bend_z": 0.0 * log.columns["bend_z"]}) for log in logs]
    assert said(flat, "stiffness_across").startswith("Motions toward both ulnar and flexion")
    cells = {f"tension_{k}": 5.0 + 0.0 * logs[0].columns["time"] for k in (1, 2, 4, 5)}
    weighed = replace(logs[0], columns={**logs[0].columns, **cells})
    assert "Tensions" in said(logs[:1], "friction") and said([weighed], "friction") == ""


def test_forces_are_told_where_somebody_has_said_a_mass_or_a_tension() -> None:
    time = 0.02 * np.arange(50.0)
    columns = {"time": time, "bend_y": 0.1 * time, "bend_z": 0.1 * time}
    columns |= {f"spool_{number}": 1e-3 * time for number in (1, 2, 4, 5)}

    def scaled(wrist: WristParameters, *masses: float, **fixed: float) -> bool:
        weighed = [{"mass": np.full(len(time), mass)} for mass in masses] or [{}]
        logs = [OpenLog(Path("log.csv"), "log", columns | mass) for mass in weighed]
        settings = IdentifySettings.model_validate({"fix": fixed})
        places = places_of_log(logs[0], wrist)
        return forces_are_scaled(
            bend_problem(trials_of_logs(logs, wrist, 1e-3), places, wrist, TENDONS, settings), wrist
        )

    assert not scaled(KNOWN) and not scaled(KNOWN, KNOWN.hand_mass)
    assert scaled(WristParameters(hand_mass=KNOWN.hand_mass)) and scaled(KNOWN, 0.2) and scaled(KNOWN, 0.3, 0.1)
    assert scaled(KNOWN, tendon_stiffness=2e4) and not scaled(KNOWN, friction=0.1)
    columns |= {f"tension_{number}": 5.0 + time for number in (1, 2, 4, 5)}
    assert scaled(KNOWN)
    told = {"a": Told(1.0, 0.9, 1.1, "N m s/rad", ""), "b": Told(1.0, 0.9, 1.1, "deg", "")}
    assert [one.known for one in without_forces(told).values()] == [False, True]


@pytest.mark.painted
@pytest.mark.slow
def test_logs_in_two_planes_tell_springs_and_tendons_in_a_run_of_their_own(call: Call, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rig = drawn_rig(rng)
    logs = logs_of(rig, rng)
    files = [tmp_path / log.file.name for log in logs]
    for log, file in zip(logs, files, strict=True):
        write_log(log, file)
    options = ("--set", "model=wrist", "--set", "segments=2", "--set", "exposure=0.004")
    code, out, err = call("identify", *map(str, files), *options)
    assert code == 0, err
    found = open_run(out.splitlines()[-1])
    axis = found.metrics["stiffness_axis_deg"]
    truth = rig.truth(axis["value"])
    assert axis["value"] == pytest.approx(truth["stiffness_axis_deg"], abs=2.0)
    for name in ("stiffness", "stiffness_across"):
        assert found.metrics[name]["value"] == pytest.approx(truth[name], rel=0.02)
    lines = [line for line in out.splitlines()[:-1] if not line.startswith("wristctl")]
    assert "N m/rad toward" in " ".join(out.split()) and all(len(line) <= 100 for line in lines)
    text = found.file("data/identified.yaml").read_text()
    two = with_identified(Study(simulate={"reference": Reference(kind="circle")}), "simulate", text)  # type: ignore[arg-type]
    places = TendonLayout.of(two.wrist).cross_section
    assert places == pytest.approx(rig.layout.cross_section, abs=1e-4)
    assert two.wrist.stiffness_axis_deg == axis["value"]
    assert with_identified(Study(), "simulate", text).wrist.tendons == "four"
    family = load_study([found.file("data/posterior.yaml")]).families["posterior"]
    axes = [row["plant.stiffness_axis_deg"] for row in family.together]
    assert len(axes) == 200 and np.std(axes) == pytest.approx(
        (axis["interval"][1] - axis["interval"][0]) / 3.92, rel=0.3
    )
    assert call("runs", "verify", found.id)[0] == 0


@pytest.mark.painted
@pytest.mark.slow
def test_three_tendons_are_simulated_and_identified_and_all_else_says_what_takes_them(
    call: Call, tmp_path: Path
) -> None:
    """The log of a circle tells springs that are weaker than believed, in both planes."""
    three = ("--set", "wrist.tendons=three")
    loop = (
        "loop={control_period: 5.0e-3, actuator: {level: tendon, microstep: 128}, sensor: {level: camera}, "
        "plant: {stiffness: 0.5}}"
    )
    circle = ("--reference", "circumduction", "--controller", "ct-dob", "--set", "horizon=3.0")
    code, out, err = call("simulate", *three, *circle, "--set", loop)
    assert code == 0 and "in two planes (3 tendons" in " ".join(out.split()), err
    moved = open_run(out.splitlines()[-1])
    assert moved.metrics["rmse"]["value"] < np.radians(1.0)
    log = tmp_path / "three.csv"
    assert call("runs", "export", moved.id, "--file", str(log))[0] == 0
    told = ("--set", "model=wrist", "--set", "segments=2", "--set", "misfit=tell", "--set", "wrist.hand_mass=0.3")
    code, out, err = call("identify", str(log), *three, *told)
    assert code == 0, err
    found = open_run(out.splitlines()[-1])
    assert found.metrics["stiffness"]["value"] == pytest.approx(0.5, rel=0.05)
    assert not (found.path / "data" / "posterior.yaml").exists() and "wristctl compare" not in out
    gains, advised = (shlex.split(line)[1:] for line in out.splitlines() if line.startswith("wristctl "))
    assert call(*gains, "--dry-run")[0] == 0
    code, out, err = call(*advised)
    assert code == 0 and "circumduction" in out and "3 tendons" in " ".join(out.split()), err
    code, out, _ = call("simulate", "--from-identified", found.id, "--dry-run")
    assert code == 0 and "one rollout of 5 s in two planes" in out
    for command in ("tune", "recommend"):
        code, out, err = call(command, "--from-identified", found.id, "--dry-run")
        assert code == 0, err
    code, out, err = call("hw-run", "--from-identified", found.id, "--dry-run")
    assert code == 0 and "two cameras" in out and "tendons that" in err, err


@pytest.mark.slow
def test_the_log_of_a_simulation_behind_elastic_tendons_tells_the_stiffness_of_three_tendons_wrist(
    call: Call, tmp_path: Path
) -> None:
    own = tmp_path / "mywrist.yaml"
    own.write_text("wrist: {tendons: three, length: 0.095, stiffness: 1.1, hand_mass: 0.25}\n")
    loop = ("--reference", "circumduction", "--set", "loop.actuator.level=tendon", "--controller", "pid-ff")
    code, out, err = call("simulate", str(own), *loop)
    assert code == 0, err
    log = tmp_path / "circumduction.csv"
    code, _, err = call("runs", "export", out.splitlines()[-1], "--file", str(log))
    assert code == 0, err
    believed = ("--config", str(own), "--set", "wrist.stiffness=0.8", "--set", "model=wrist", "--set", "segments=4")
    code, out, err = call("identify", str(log), *believed)
    assert code == 0, err
    found = load_study([open_run(out.splitlines()[-1]).file("data/identified.yaml")]).wrist
    assert found.stiffness == pytest.approx(1.1, rel=0.05)
    assert found.stiffness * found.flexion_ratio == pytest.approx(1.1, rel=0.05)
    assert len(TendonLayout.of(found).places) == 3
