"""What `recommend` leaves for other commands: the rig that is emulated, and the robot of one's own that is named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from pydantic import ValidationError

import wristctl
from wristctl.commands.identified_wrist import Found, with_found
from wristctl.commands.identify.command import _problem
from wristctl.commands.recommend.reach import family_of_rigs
from wristctl.commands.recommend.rehearsals import _asked
from wristctl.commands.recommend.study_file import next_command, own_rig, sections_of, takers_of, trial_of
from wristctl.errors import UserError
from wristctl.identification.ratios import SCHEMA

RATIOS = {"values": {"gain": 0.99, "damping": 0.3, "delay": 3e-3}, "angles": [0.0, 3.14159265], "radius": 0.02}
STIFF = "wrist.stiffness=1.1"


def found(**changes: Any) -> Found:
    return Found("log-run", "", {"schema": SCHEMA, "rate": 100.0, **RATIOS, **changes})


def test_what_a_log_does_not_tell_is_drawn_as_of_any_rig_and_what_it_tells_is_not() -> None:
    """This one tells radius, damping and delay; somebody says the stiffness; tendons and friction are nobody's."""
    unknown = wristctl.load_study(None, STIFF)
    drawn, usual = with_found(unknown, "recommend", found()).recommend.draw, unknown.recommend.draw
    assert drawn["plant.stiffness"] == "x0.9..1.1" and drawn["plant.damping"] == "x0.8..1.25"
    assert drawn["plant.tendon_radius"] == "x0.99..1.01"
    for leaf in ("tendon_stiffness", "friction", "sheath"):
        assert drawn[f"plant.actuator.{leaf}"] == usual[f"plant.actuator.{leaf}"]
    assert drawn["plant.sensor.delay_frames"] == "0..0.8", "half a frame beside 0.3 of one"
    late = with_found(unknown, "recommend", found(values={"delay": 0.02})).recommend.draw
    assert late["plant.sensor.delay_frames"] == "1.5..2.5" and late["plant.damping"] == usual["plant.damping"]
    silent = with_found(unknown, "recommend", found(values={"tendon": 8.0})).recommend.draw
    assert silent["plant.sensor.delay_frames"] == usual["plant.sensor.delay_frames"]
    assert silent["plant.actuator.tendon_stiffness"] == "x0.9..1.1"
    with pytest.raises(UserError, match="nobody has said that"):
        with_found(wristctl.load_study(None), "recommend", found())


def test_the_emulated_rig_has_the_tendons_and_the_camera_that_were_identified() -> None:
    known = with_found(wristctl.load_study(None, STIFF), "recommend", found(values={"tendon": 8.0, "delay": 3e-3}))
    asked = _asked(known, [], 20.0, 1, 1.0)
    believed = known.recommend.loop
    assert asked.bench.actuator.tendon_stiffness == believed.actuator.tendon_stiffness != 20e3
    assert asked.bench.camera.frame_rate == 100.0 and asked.bench.camera.delay_frames == pytest.approx(0.3)
    content: Any = sections_of(known, 20.0)["hw_run"]
    assert content["bench"]["camera"]["frame_rate"] == 100.0 and "camera_2" not in content["bench"]
    assert "camera_2" in dict(sections_of(known, 20.0, 2)["hw_run"])["bench"]
    own = wristctl.load_study(None, "hw-run.bench.camera.delay_frames=3", "recommend.loop.sensor.delay_frames=1")
    assert _asked(own, [], 20.0, 1, 0.7).bench.camera.delay_frames == 3.0, "what a study says of it stays"
    assert _asked(own, [], 20.0, 1, 0.7).bench.plant.stiffness_scale == 0.7
    assert "bench" not in sections_of(wristctl.load_study(None), 20.0)["hw_run"]
    fast = wristctl.load_study(None, "recommend.loop.control_period=2.0e-3", "recommend.loop.sensor.frame_rate=500")
    camera = _asked(fast, [], 20.0, 1, 1.0).bench.camera
    assert camera.frame_rate == 500.0 and camera.exposure * camera.frame_rate <= 1.0


def test_trials_wind_by_the_stretch_that_homing_measures_unless_a_study_says_otherwise() -> None:
    """Simulated rigs are homed as the trial's is; one that is simulated alone, or a robot of one's own, is not."""

    def of(*words: str) -> tuple[Any, bool]:
        study = wristctl.load_study(None, *words)
        sections: Any = sections_of(study, 20.0)
        return sections.get("hw_run", {}).get("homing"), family_of_rigs(study, 20.0).homed

    assert of() == ({"stretch": "measured"}, True)
    assert of("hw-run.homing.frames=7") == ({"frames": 7, "stretch": "measured"}, True)
    assert _asked(wristctl.load_study(None, "hw-run.homing.frames=7"), [], 20.0, 1, 1.0).homing.frames == 7
    assert of("hw-run.homing.stretch=measured") == ({"stretch": "measured"}, True)
    assert of("hw-run.homing.stretch=believed") == (None, False)
    assert of("recommend.loop.sensor.level=ideal") == (None, False) == of("hw-run.rig=servos")


def test_what_is_known_of_a_rig_takes_the_place_of_what_is_drawn_of_any_and_leaves_the_rest() -> None:
    usual = wristctl.load_study(None).recommend
    stated = wristctl.load_study(None, "recommend.known={plant.hand_mass: x1..1.05, plant.payload: 0..0.1}").recommend
    weights = {"plant.hand_mass": "x1..1.05", "plant.payload": "0..0.1"}
    assert stated.family(20.0).draw == usual.family(20.0).draw | weights
    assert stated.measured().family(20.0).draw == usual.measured().family(20.0).draw | weights
    wide = wristctl.load_study(None, "recommend.known={plant.stiffness: x0.5..2}").recommend
    assert wide.measured().drawn["plant.stiffness"] == "x0.5..2", "what somebody says stays"
    with pytest.raises(ValidationError, match="no such leaf"):
        wristctl.load_study(None, "recommend.known={plant.hand_weight: x1..1.05}").recommend.family(20.0)


def test_the_trial_of_a_wrist_whose_trials_are_on_a_robot_of_ones_own_names_it() -> None:
    for planes, words in ((1, ()), (2, ("wrist.tendons=three",))):
        study = wristctl.load_study(None, "hw-run.rig=servos", *words)
        assert own_rig(study) == "servos" and trial_of(study) == "hw-run" == takers_of(study)
        assert next_command(study, (), "f.yaml") == "wristctl hw-run --rig servos f.yaml"
        assert sections_of(study, 12.0, planes) == {"hw_run": {"rig": "servos", "reference": {"angle_deg": 12.0}}}
    other = study.model_copy(update={"recommend": study.recommend.model_copy(update={"rig": "bench"})})
    assert own_rig(other) == "bench", "which recommend is told goes first"


def test_trials_of_a_robot_of_ones_own_are_identified_by_their_log() -> None:
    study = wristctl.load_study(None, "hw-run.rig=servos")
    inputs: Any = SimpleNamespace(
        runs=lambda: {"runs[0]": SimpleNamespace(config=study, id="its-run")}, read=lambda *_: 1
    )
    with pytest.raises(UserError, match="a robot of your own") as told:
        _problem(study, inputs)
    assert "runs export" in str(told.value.fix)
