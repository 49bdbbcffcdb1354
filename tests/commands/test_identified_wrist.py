"""What stays of a study beside an identified wrist: the geometry of its log's fit, and what was given by hand."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path
from typing import Any

import pytest

import wristctl
from wristctl.commands.identified_wrist import found_in, identified, with_found
from wristctl.commands.inputs import Inputs
from wristctl.commands.perform import Prepared, prepare, study_with
from wristctl.commands.procedure import procedure_named
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.identification.ratios import SCHEMA
from wristctl.records import Run, open_run, start_run
from wristctl.study_files.load import read_study
from wristctl.wrist.tendon_layout import TendonLayout

STIFF = "wrist.stiffness=1.1"
VALUES = {"gain": 0.8, "damping": 0.3, "delay": 6e-3}
# Loops that have a camera and ticks of 10 ms, by command.
CAMERA = {
    "simulate": "loop={control_period: 0.01, sensor: {level: camera}}",
    "compare": "loops={rig: {control_period: 0.01, sensor: {level: camera}}}",
    "tune": "loops={rig: {control_period: 0.01, sensor: {level: camera}}}",
    "recommend": "seed=0",
    "hw-run": "seed=0",
}


def log_run(
    folder: Path, rate: float = 100.0, values: dict[str, float] | None = None, *settings: str, angles: int = 2
) -> Run:
    """A run that identified a log of two tendons, or of so many evenly round the axis, with a wrist of 95 mm."""
    places = [2.0 * math.pi * number / angles for number in range(angles)]
    told = {"schema": SCHEMA, "values": values or VALUES, "angles": places, "radius": 0.02, "rate": rate}
    folder.mkdir(exist_ok=True)
    log = folder / "log.csv"
    log.write_text("time [s],bend_y [deg]\n0,0\n")
    study = wristctl.load_study(None, "wrist.length=0.095", f"identify.logs=[{log}]", *settings)
    with start_run("identify", study, out=folder / "results") as run:
        path = run.file("data/ratios.json")
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(told))
    return open_run(str(run.path))


def prepared(command: str, run: Run, *settings: str) -> Prepared[Any]:
    study, origins = read_study([], [STIFF, *settings], command)
    return prepare(procedure_named(command), study, run.path.parent, {"from_identified": run}, origins=origins)


def known(command: str, run: Run, *settings: str) -> Study:
    """The study of a command with what a run identified."""
    there = prepared(command, run, *settings)
    return identified(there.study, command, there.inputs)


def loop_of(study: Study, command: str) -> Loop:
    section = getattr(study, command.replace("-", "_"))
    loops = getattr(section, "loops", None)
    return loops["rig"] if loops else section.known_loop if command == "hw-run" else section.loop


def test_an_identified_wrist_of_three_tendons_is_tried_in_two_planes_on_a_rig_that_has_them(tmp_path: Path) -> None:
    run = log_run(tmp_path, angles=3)
    for settings in ((), ("hw-run.planes=2",), ("wrist.tendons=three",), ("hw-run.port=/dev/ttyUSB0",)):
        study, found = prepared("hw-run", run, *settings).study, known("hw-run", run, *settings)
        assert study.hw_run.planes == found.hw_run.planes == 2
        assert len(TendonLayout.of(study.wrist).places) == len(TendonLayout.of(found.wrist).places) == 3
    with pytest.raises(UserError, match="in one plane"):
        known("hw-run", run, "hw-run.planes=1")
    with pytest.raises(UserError, match="3 tendons were identified, and the rig has 4"):
        known("hw-run", run, "wrist.tendons=four")
    two = prepared("hw-run", log_run(tmp_path / "two")).study
    assert (two.hw_run.planes, two.wrist.tendons) == (1, "four"), "which bend in one plane"


@pytest.mark.parametrize("rate", [50.0, 100.0000000000003, 200.0])
@pytest.mark.parametrize("command", CAMERA)
def test_a_log_of_any_rate_is_a_camera_of_one_frame_a_tick_at_most_as_late_as_the_log(
    command: str, rate: float, tmp_path: Path
) -> None:
    sensor = loop_of(known(command, log_run(tmp_path, rate), CAMERA[command]), command).sensor
    assert sensor.frame_rate == pytest.approx(min(rate, 100.0), rel=1e-12) and sensor.frame_rate <= 100.0
    assert sensor.delay_frames / sensor.frame_rate == pytest.approx(6e-3)


@pytest.mark.parametrize("command", CAMERA)
def test_what_is_given_by_hand_wins_over_what_a_log_tells(command: str, tmp_path: Path) -> None:
    place = {"compare": "loops.rig.", "tune": "loops.rig.", "hw-run": ""}.get(command, "loop.")
    own = (CAMERA[command], f"{place}sensor.frame_rate=60", "wrist.damping=0.2")
    study = known(command, log_run(tmp_path), *own)
    sensor = loop_of(study, command).sensor
    assert sensor.frame_rate == 60.0 and sensor.delay_frames / 60.0 == pytest.approx(6e-3)
    assert study.wrist.damping == 0.2 and study.wrist.tendon_radius == pytest.approx(0.02 / 0.8)


def test_what_was_given_is_known_to_a_repetition_of_the_run_and_kept_beside_nothing_else(tmp_path: Path) -> None:
    run = log_run(tmp_path)
    own = (CAMERA["simulate"], "loop.sensor.frame_rate=60")
    again = tmp_path / "again.yaml"
    first = prepared("simulate", run, *own).study
    again.write_text(json.dumps(first.model_dump(mode="json", by_alias=True, exclude={"sweep"})))
    study, origins = read_study([again], [], "simulate")
    there = prepare(procedure_named("simulate"), study, run.path.parent, origins=origins)
    for whole in (identified(first, "simulate", Inputs({"from_identified": run})),
                  identified(there.study, "simulate", there.inputs)):  # fmt: skip
        assert (whole.simulate.loop.sensor.frame_rate, whole.wrist.length) == (60.0, 0.095)
        assert whole.wrist.damping == pytest.approx(known("simulate", run).wrist.damping)
    alone, origins = read_study([], own, "simulate")
    assert prepare(procedure_named("simulate"), alone, tmp_path, origins=origins).study.simulate.kept == ()


@pytest.mark.parametrize("command", [*CAMERA, "analyse"])
def test_the_geometry_by_which_a_log_was_fitted_is_taken_and_said(
    command: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    run = log_run(tmp_path, 100.0, None, "wrist.discs=6", "wrist.tendon_radius=0.03")
    wrist = prepared(command, run).study.wrist
    assert (wrist.length, wrist.discs, wrist.tendon_radius) == (0.095, 6, 0.03)
    assert "wrist.length = 0.095, wrist.discs = 6" in caplog.text
    other = prepared(command, run, "wrist.length=0.1").study.wrist
    assert (other.length, other.discs) == (0.1, 6)


def test_the_radius_of_the_fit_said_again_is_still_that_of_the_fit(tmp_path: Path) -> None:
    run = log_run(tmp_path, 100.0, None, "wrist.tendon_radius=0.03")
    for again in ((), ("wrist.tendon_radius=0.03",)):
        assert known("simulate", run, *again).wrist.tendon_radius == pytest.approx(0.03 / 0.8)
    assert known("simulate", run, "wrist.tendon_radius=0.02").wrist.tendon_radius == 0.02


def test_whose_each_setting_is_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    known("simulate", log_run(tmp_path), "wrist.damping=0.2", "loop.sensor.frame_rate=60")
    said = caplog.messages[-2] if "exact" in caplog.messages[-1] else caplog.messages[-1]
    log, study, settings, *_ = said.split("; ")
    assert "sensor.delay_frames" in log and "wrist.damping" not in log and "frame_rate" not in log
    assert all(name in study for name in ("wrist.stiffness", "wrist.damping", "sensor.frame_rate"))
    assert "wrist.length" in settings and "wrist.length" not in study


def test_a_stiffness_that_is_given_beside_a_log_with_forces_is_what_damping_goes_by(tmp_path: Path) -> None:
    run = log_run(tmp_path, 100.0, {**VALUES, "force": 2.0})
    soft, stiff = (known("simulate", run, f"wrist.stiffness={value}").wrist for value in (1.1, 2.2))
    assert (soft.stiffness, stiff.stiffness) == (1.1, 2.2) and stiff.damping - soft.damping == pytest.approx(0.33)
    by_log = with_found(wristctl.load_study(None), "simulate", found_in(run)).wrist
    assert by_log.damping == pytest.approx(0.6)


def test_an_identification_that_refused_is_named(tmp_path: Path) -> None:
    with start_run("identify", Study(), out=tmp_path / "results") as run:
        pass
    with pytest.raises(UserError, match="wrist"):
        prepared("simulate", open_run(str(run.path)))


@pytest.mark.parametrize("settings", [{}, {"seed": 3}])
@pytest.mark.parametrize("given", ["wrist.damping=0.2", "wrist.tendon_radius=0.019"])
def test_overrides_of_a_study_in_python_win_over_what_a_log_tells_as_settings_do(
    given: str, settings: dict[str, Any], tmp_path: Path
) -> None:
    run, (name, value) = log_run(tmp_path), given.removeprefix("wrist.").split("=")
    loaded = wristctl.load_study(None, STIFF, given)
    whole, origins = study_with(loaded, "simulate", settings)
    there = prepare(procedure_named("simulate"), whole, tmp_path, {"from_identified": run}, origins=origins)
    found = identified(there.study, "simulate", there.inputs).wrist
    assert getattr(found, name) == float(value)
    by_option = known("simulate", run, given).wrist
    assert found == by_option
    of_file = tmp_path / "mine.yaml"
    of_file.write_text(f"wrist: {{stiffness: 1.1, {name}: {value}}}\n")
    whole, origins = study_with(wristctl.load_study(of_file), "simulate", settings)
    there = prepare(procedure_named("simulate"), whole, tmp_path, {"from_identified": run}, origins=origins)
    assert getattr(identified(there.study, "simulate", there.inputs).wrist, name) != float(value)


def test_where_keys_are_from_is_no_part_of_what_a_study_is(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("wrist: {damping: 0.2}\n")
    by_file, by_override = wristctl.load_study(file), wristctl.load_study(None, "wrist.damping=0.2")
    assert by_file == by_override
    assert ("wrist", "damping") in pickle.loads(pickle.dumps(by_override)).overrides and not by_file.overrides


@pytest.mark.parametrize(
    ("rate", "settings", "said"),
    [(100.0, (), True), (60.0, (), False), (100.0, ("bench.camera.frame_rate=100",), False), (50.0, (), True)],
)
def test_an_emulated_rig_says_that_its_camera_is_not_the_identified_one(
    rate: float, settings: tuple[str, ...], said: bool, tmp_path: Path
) -> None:
    there = prepared("hw-run", log_run(tmp_path, rate), *settings)
    plan = there.plan()
    assert (f"bench.camera.frame_rate={rate:g}" in plan) == said
    assert ("60 frames" in plan) == said and "camera_2" not in plan
