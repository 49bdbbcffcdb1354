"""A wrist by what its log tells, ratios to the stiffness that it shows, and by the stiffness that somebody says."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import wristctl
from wristctl.commands.export.run_data import export_run
from wristctl.commands.identify.logs import LogTold
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.ratios import SCHEMA, LogWrist, wrist_by_ratios
from wristctl.identification.unknowns import with_identified
from wristctl.study_files.strict_yaml import parse_yaml

UPRIGHT, LEVEL, HANGING = (-9.81, 0.0), (0.0, -9.81), (9.81, 0.0)
OF_THREE = [0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0]


def shown(wrist: WristParameters) -> float:
    """What springs and weight hold together: the hand sinks by (L/3 + h) theta^2/2, half of the wrist with its end."""
    sinks = wrist.hand_mass * (wrist.length / 3.0 + wrist.hand_offset) + wrist.mass * wrist.length / 6.0
    return wrist.stiffness + wrist.gravity[0] * sinks


def told(angles: list[float], radius: float, **values: float) -> dict[str, Any]:
    return {"schema": SCHEMA, "values": values, "angles": angles, "radius": radius, "rate": 100.0}


def read(wrist: LogWrist) -> Any:
    return parse_yaml(wrist.yaml, "identified.yaml").data


@pytest.mark.parametrize("gravity", [UPRIGHT, LEVEL, HANGING])
@pytest.mark.parametrize("gain", [1.0, 0.8, 1.25])
def test_the_wrist_that_shows_these_ratios_is_found(gravity: tuple[float, float], gain: float) -> None:
    wrist = WristParameters.model_validate({"tendons": "three", "stiffness": 0.9, "gravity": gravity})
    tendon, radius = 12e3, wrist.tendon_radius / gain
    ratios = told(
        OF_THREE, wrist.tendon_radius, gain=gain, damping=0.1 / shown(wrist), delay=0.03, friction=0.2, sheath=0.1,
        tendon=tendon / gain**2 * wrist.tendon_radius**2 / shown(wrist),
    )  # fmt: skip
    found = read(wrist_by_ratios(ratios, Study(wrist=wrist), "a run"))
    assert found["wrist"]["stiffness"] == pytest.approx(0.9) and found["wrist"]["damping"] == pytest.approx(0.1)
    assert found["wrist"]["tendon_radius"] == pytest.approx(radius) and "tendons" not in found["wrist"]
    loop = found["simulate"]["loop"]
    assert loop["actuator"]["tendon_stiffness"] == pytest.approx(tendon)
    assert loop["actuator"]["friction"] * loop["actuator"]["sheath"] == pytest.approx(0.1)
    assert loop["sensor"]["delay_frames"] == pytest.approx(3.0)


def test_what_the_log_does_not_tell_of_tendons_stays_as_the_command_has_it() -> None:
    study = Study(wrist=WristParameters(stiffness=1.1))
    wrist = wrist_by_ratios(told([0.0, math.pi], 0.014, damping=0.1), study, "a run")
    known, own = with_identified(study, "recommend", wrist.yaml), study.recommend.loop
    assert known.wrist.damping == pytest.approx(0.1 * shown(study.wrist))
    assert known.recommend.loop.actuator == own.actuator and known.recommend.loop.sensor == own.sensor


def test_tensions_in_the_log_tell_the_springs_beside_the_weight() -> None:
    wrist = WristParameters.model_validate({"gravity": HANGING})
    ratios = told([0.0, math.pi], wrist.tendon_offset, force=0.9)
    found = wrist_by_ratios(ratios, Study(wrist=wrist), "a run")
    assert read(found)["wrist"]["stiffness"] == pytest.approx(0.9 - shown(wrist) + wrist.stiffness)
    assert "wrist.stiffness" in found.told and "wrist.gravity" in found.given and "wrist.hand_mass" in found.assumed


def test_each_of_two_antagonists_is_a_side_of_the_square() -> None:
    wrist = WristParameters.model_validate({"stiffness": 1.1})
    ratios = told([0.0, math.pi], wrist.tendon_offset, tendon=20.0)
    found = read(wrist_by_ratios(ratios, Study(wrist=wrist), "a run"))["simulate"]["loop"]["actuator"]
    of_a_side = 2.0 * found["tendon_stiffness"] * wrist.tendon_offset**2
    assert of_a_side / shown(wrist) == pytest.approx(20.0)


def test_tendons_that_are_not_the_studys_come_with_their_places() -> None:
    wrist = WristParameters.model_validate({"stiffness": 1.1})
    found = read(wrist_by_ratios(told(OF_THREE, 0.02, turn=0.1, gain=0.5), Study(wrist=wrist), "a run"))
    assert [place["angle_deg"] for place in found["wrist"]["tendons"]] == pytest.approx(
        [math.degrees(0.1 + angle) for angle in OF_THREE]
    )
    assert found["wrist"]["tendons"][0]["radius"] == pytest.approx(0.04)


def test_without_a_stiffness_it_is_asked_for_and_one_that_buckles_is_refused() -> None:
    ratios = told([0.0, math.pi], 0.014, tendon=20.0)
    with pytest.raises(UserError, match="nobody has said that") as asked:
        wrist_by_ratios(ratios, Study(), "a run")
    assert "--set wrist.stiffness" in str(asked.value) and "tension_1" in str(asked.value)
    with pytest.raises(UserError, match="buckles"):
        wrist_by_ratios(ratios, Study(wrist=WristParameters(stiffness=0.2)), "a run")


@pytest.mark.slow
def test_a_robot_of_three_tendons_comes_back_from_its_log(tmp_path: Path) -> None:
    """Its simulated log identified, with its stiffness said: tendons within a tenth, and the same motion."""
    rig = [
        "wrist.tendons=three", "wrist.stiffness=0.8", "simulate.reference.kind=circumduction",
        "simulate.controller=pid-ff", "simulate.gains=hardware", "simulate.loop.control_period=0.01",
        "simulate.loop.actuator.level=tendon", "simulate.loop.actuator.tendon_stiffness=1e4",
        "simulate.loop.actuator.friction=0.05", "simulate.loop.sensor.level=camera",
    ]  # fmt: skip
    study = wristctl.load_study(None, *rig)
    course = wristctl.simulate(study, out=tmp_path)
    assert course.run is not None
    log = tmp_path / "three.csv"
    export_run(course.run, "csv", log)
    found = wristctl.identify(wristctl.load_study(None, "wrist.tendons=three", f"identify.logs=[{log}]"))
    assert isinstance(found, LogTold)
    wrist = read(wrist_by_ratios(found.ratios, study, "a run"))
    assert wrist["simulate"]["loop"]["actuator"]["tendon_stiffness"] == pytest.approx(1e4, rel=0.1)
    assert wrist["wrist"]["damping"] == pytest.approx(study.wrist.damping, rel=0.15)
