"""`recommend --rig`: rigs are drawn from the facts of a robot of one's own, and what is found runs on it."""

from __future__ import annotations

import hashlib
import math
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.doors.conftest import wristctl
from tests.doors.test_own_rig import ONE_PLANE, written
from wristctl.commands.adoption import adopted
from wristctl.commands.recommend.own_rig import drawn_by_facts, narrowed, on_the_rig, said_of_facts
from wristctl.commands.recommend.reach import asked_of_rigs, family_of_rigs
from wristctl.config.choices import RIGS
from wristctl.config.loop import Reference
from wristctl.config.recommend import MEASURED, RecommendSettings
from wristctl.config.study import Study
from wristctl.records import Run

SPREADS = (
    ("Refused, Sensor, Tendon", "Refused, Sensor, Spread, Tendon"),
    ("Drive(delay=DELAY, ", "Drive(delay=Spread(DELAY, 0.008, 0.02), lag=Spread(0.002, 0.001, 0.004), "),
    ("resolution=1e-5", "resolution=Spread(2e-5, 1e-5, 5e-5)"),
    (
        "Sensor(rate=1.0 / STEP, delay=DELAY, noise_deg=0.02)",
        "Sensor(Spread(50.0, 40.0, 80.0), Spread(0.02, 0.01, 0.03), Spread(0.05, 0.02, 0.1))",
    ),
)


def study_of(folder: Path, *changes: tuple[str, str], **settings: Any) -> Study:
    study = Study(recommend=RecommendSettings(rig=written(folder, *changes), **settings))
    return on_the_rig(adopted(study, "recommend").study)


@pytest.mark.slow
def test_rigs_are_drawn_from_the_ranges_of_the_facts(tmp_path: Path) -> None:
    study = study_of(tmp_path, *SPREADS, references=(Reference(),))
    family = family_of_rigs(study, 20.0)
    loops = [family.world(dict.fromkeys(family.draw, 0.5) | {"together": (k + 0.5) / 32}) for k in range(32)]
    sensors = [loop.plant.sensor.of(loop.sensor) for loop in loops]
    drawn: dict[str, tuple[list[Any], float, float]] = {
        "delay [s]": ([loop.plant.actuator.command_delay for loop in loops], 0.008, 0.020),
        "lag [s]": ([loop.plant.actuator.lag for loop in loops], 0.001, 0.004),
        "resolution [m]": ([loop.actuator.resolution for loop in loops], 1e-5, 5e-5),
        "fastest [m/s]": ([loop.actuator.step_length * loop.actuator.step_rate for loop in loops], 0.2, 0.2),
        "rate [1/s]": ([loop.sensor.frame_rate for loop in loops], 40.0, 80.0),
        "age [s]": ([sensor.delay_frames / sensor.frame_rate for sensor in sensors], 0.01, 0.03),
        "believed age [s]": ([loop.sensor.delay_frames / loop.sensor.frame_rate for loop in loops], 0.02, 0.02),
        "noise [deg]": ([sensor.noise_deg for sensor in sensors], 0.02, 0.1),
    }
    for name, (values, low, high) in drawn.items():
        assert low * (1 - 1e-2) <= min(values) and max(values) <= high * (1 + 1e-9), name
        assert max(values) - min(values) >= 0.7 * (high - low), name
    assert "plant.actuator.friction" in family.draw  # which no fact speaks of
    said = said_of_facts(study)
    assert "Drawn from their ranges: drive delay 8 to 20 ms, lag 1 to 4 ms, resolution 0.01 to 0.05 mm" in said
    assert "sensor rate 40 to 80 1/s, sensor delay 10 to 30 ms, noise 0.02 to 0.1 deg." in said


def test_a_fact_that_is_a_number_is_not_drawn_and_a_study_goes_before(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    family = family_of_rigs(study, 20.0)
    assert family.together == () and not {"plant.sensor.delay_frames", "plant.sensor.noise_deg"} & set(family.draw)
    believed = study.recommend.loop
    assert believed.actuator.command_delay == pytest.approx(0.01) and believed.planes == 2
    assert believed.sensor.delay_frames / believed.sensor.frame_rate == pytest.approx(0.01)
    assert len(study.wrist.tendons) == 3 and study.wrist.stiffness == 1.2
    assert study.wrist.tension_limit == pytest.approx(0.8 * 60.0)  # what hw-run asks of such motors
    assert "No fact is a Spread" in said_of_facts(study)
    own = study_of(tmp_path, *SPREADS, draw={"plant.sensor.noise_deg": "0.3..0.4"})
    assert all("plant.sensor.noise_deg" not in row for row in family_of_rigs(own, 20.0).together)


def test_a_log_narrows_what_it_tells_and_the_facts_stay_for_the_rest(tmp_path: Path) -> None:
    """Also where a run's own config.yaml, which has what is drawn, is run again."""
    spread = ("stiffness=TENDON", "stiffness=Spread(2e4, 1e4, 4e4)")
    study = study_of(tmp_path, SPREADS[0], spread)
    usual, name, key = study.recommend, study.recommend.rig, "plant.actuator.tendon_stiffness"
    assert name is not None and usual.draw == drawn_by_facts(RIGS[name].facts) and usual.draw[key] == "x0.5..2"
    told = narrowed(study, {"wrist.damping"}).recommend.draw
    assert told == usual.draw | {"plant.damping": MEASURED["plant.damping"]} != usual.draw
    whole = narrowed(study, None).recommend.draw
    assert whole == usual.draw | MEASURED and not {"plant.sensor.delay_frames", "plant.sensor.noise_deg"} & set(whole)
    again = study.model_copy(update={"recommend": RecommendSettings.model_validate(usual.model_dump())})
    assert narrowed(again, {"wrist.damping"}).recommend.draw == told
    own = study.model_copy(update={"recommend": RecommendSettings(rig=name, draw={key: "x0.9..1.2"})})
    assert narrowed(own, None).recommend == own.recommend, "what somebody says stays"
    any_rig = narrowed(Study(), {"wrist.damping"}).recommend.draw
    assert any_rig == RecommendSettings().draw | {"plant.damping": MEASURED["plant.damping"]}


def test_in_one_plane_a_side_has_the_stiffness_and_the_lever_of_its_tendons(tmp_path: Path) -> None:
    study = study_of(tmp_path, *ONE_PLANE)
    assert family_of_rigs(study, 20.0).loop.planes == 1 and len(asked_of_rigs(study)) > 1
    assert 2.0 * study.recommend.loop.actuator.tendon_stiffness == pytest.approx(20e3)
    assert study.wrist.tendon_radius / math.sqrt(2.0) == pytest.approx(0.02)


@pytest.mark.slow
def test_what_is_recommended_runs_on_the_robot_and_is_sealed_with_its_hash(tmp_path: Path) -> None:
    reference = written(tmp_path)
    quick = (
        "recommend={controllers: [pid-ff], loop: {plant_segments: 1, actuator: {level: ideal}, sensor: {level: ideal}},"
        " draw: {plant.stiffness: x0.9..1.1}, horizon: 1.5, draws: 2, validation: 2, tests: 8, candidates: 4,"
        " iterations: 1, frequencies: [0.5], payloads: [0.1]}"
    )
    done = wristctl(tmp_path, "recommend", "--rig", reference, "--set", quick)
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert f"From the facts of {reference}: 3 tendons of up to 60 N in 2 planes" in words
    command = shlex.split(next(line for line in done.stdout.splitlines() if line.startswith("wristctl hw-run")))
    assert command[:4] == ["wristctl", "hw-run", "--rig", reference]
    run = Run(tmp_path / Path(command[-1]).parents[1])
    digest = hashlib.sha256((tmp_path / "my_rig.py").read_bytes()).hexdigest()
    assert run.manifest.code.foreign == {"code/my_rig/my_rig.py": digest}
    trial = wristctl(tmp_path, *command[1:], "--set", "directions=[ulnar]", "--horizon", "1.5", "-q")
    assert trial.returncode == 0, trial.stderr
    performed = Run(tmp_path / trial.stdout.strip().splitlines()[-1])
    found = performed.config.hw_run.rows[0].gains
    assert isinstance(found, dict) and set(found) == {"Kp", "Kd", "Ki"} and np.isfinite(list(found.values())).all()
    assert performed.manifest.code.foreign == run.manifest.code.foreign
