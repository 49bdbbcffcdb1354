"""Parameters, their coordinates, and where each stands in a study."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import wristctl.identification
from tests.values import changeable
from wristctl.config.identify import Fixed
from wristctl.config.wrist import TendonPlace
from wristctl.identification.unknowns import UNKNOWNS, identified_yaml, tendons_of_values, with_identified
from wristctl.study_files.load import load_study

LOGARITHMS = {name for name, each in UNKNOWNS.items() if each.log}


def test_the_table_holds_what_a_study_may_fix_and_all_but_the_delay_is_simulated() -> None:
    of_loops = {"inner_friction", "inner_presliding_deg"}
    assert set(UNKNOWNS) == set(Fixed.model_fields) - of_loops, "a measured loop of hysteresis has two of its own"
    assert {name: each.unit for name, each in UNKNOWNS.items()} == {
        name: (each.json_schema_extra or {})["unit"] if isinstance(each.json_schema_extra, dict) else ""
        for name, each in Fixed.model_fields.items()
        if name not in of_loops
    }


def test_what_must_be_positive_is_searched_by_factors_as_far_down_as_up() -> None:
    assert set(UNKNOWNS) - {"friction", "sheath_friction", "delay"} == LOGARITHMS
    for name in LOGARITHMS:
        low, high = UNKNOWNS[name].bounds()
        assert low == pytest.approx(-high) and high > 0.2
        assert UNKNOWNS[name].coordinate(3.0, 3.0) == 0.0
        assert UNKNOWNS[name].value(low, 2.0) == pytest.approx(2.0 * UNKNOWNS[name].low)
        assert UNKNOWNS[name].tolerance == (math.inf if name == "presliding" else 1.0), "a relative width"
    wide = {name: UNKNOWNS[name].high for name in LOGARITHMS}
    own = {"stiffness": 20.0, "flexion_ratio": 5.0, "damping": 50.0, "tendon_stiffness": 20.0}
    assert wide == own | {"tendon_radius": 1.25, "presliding": 10.0}


def test_friction_and_delay_are_searched_as_they_are() -> None:
    """Friction from none to where a capstan holds seven times the pull; pictures from a little early to 0.2 s late."""
    assert UNKNOWNS["friction"].bounds() == (0.0, 2.0) and math.exp(2.0) > 7.0
    assert UNKNOWNS["delay"].bounds() == (-0.05, 0.2)
    assert UNKNOWNS["delay"].coordinate(0.03, 5.0) == 0.03 == UNKNOWNS["delay"].value(0.03, 5.0)


@pytest.mark.parametrize("name", UNKNOWNS)
def test_value_and_coordinate_undo_each_other(name: str) -> None:
    unknown = UNKNOWNS[name]
    for value in (0.7, 1.3):
        at = unknown.coordinate(value, 0.9)
        assert unknown.value(at, 0.9) == pytest.approx(value)
        if unknown.log:
            assert at == pytest.approx(np.log(value) - np.log(0.9))


FOUND = {
    "stiffness": 0.11, "damping": 0.22, "tendon_radius": 0.033, "tendon_stiffness": 44e3, "friction": 0.055,
    "flexion_ratio": 1.2, "sheath_friction": 0.11, "presliding": 3e-5,
}  # fmt: skip
CAMERA = {"frame_rate": 50.0, "delay_frames": 2.5, "noise_deg": 0.07, "dropped": 0.125}


def test_what_was_identified_is_a_study_that_simulates_it() -> None:
    study = load_study([], ["seed=3"])
    text = identified_yaml(FOUND, CAMERA)
    for command in ("simulate", "tune", "compare"):
        changed = with_identified(study, command, text)
        wrist = changed.wrist
        assert (wrist.stiffness, wrist.damping, wrist.tendon_radius) == (0.11, 0.22, 0.033) and changed.seed == 3
        assert wrist.flexion_ratio == 1.2
        settings = getattr(changed, command)
        loops = [settings.loop] if command == "simulate" else settings.loops.values()
        before = getattr(study, command)
        old = [before.loop] if command == "simulate" else before.loops.values()
        assert len(loops) == len(old) > 0
        for loop, was in zip(loops, old, strict=True):
            assert (loop.actuator.tendon_stiffness, loop.actuator.friction) == (44e3, 0.055)
            assert (loop.actuator.sheath, loop.actuator.presliding) == (pytest.approx(2.0), 3e-5)
            assert {name: getattr(loop.sensor, name) for name in CAMERA} == CAMERA
            assert (loop.actuator.level, loop.sensor.level) == (was.actuator.level, was.sensor.level)
            assert loop.control_period == was.control_period and loop.plant_segments == was.plant_segments
    first = with_identified(load_study([], ["compare.tuning={controllers: [pid-ff]}"]), "compare", text).compare.tuning
    assert first is not None and all(loop.actuator.friction == 0.055 for loop in first.loops.values()), "a search first"


def test_each_place_keeps_where_its_tendons_end_and_how_many_they_are() -> None:
    given = ({"angle_deg": 10.0, "multiplicity": 2}, {"angle_deg": 100.0, "ends_at": 3}, {"angle_deg": 190.0},
             {"angle_deg": 280.0})  # fmt: skip
    drawn = tuple(TendonPlace.model_validate({"radius": 0.02} | place) for place in given)
    moved = tuple(place.model_copy(update={"angle_deg": place.angle_deg + 0.7}) for place in drawn)
    text, study = identified_yaml(FOUND, CAMERA, moved), load_study()
    unlike = study.model_copy(update={"wrist": study.wrist.model_copy(update={"tendons": drawn})})
    for command in ("simulate", "compare", "tune"):
        assert with_identified(unlike, command, text).wrist.tendons == moved
    assert with_identified(study, "compare", text).wrist.tendons == "four", "the square of a loop in one plane"


def test_the_identified_study_itself_has_tendons_and_a_camera(tmp_path: Path) -> None:
    file = tmp_path / "identified.yaml"
    file.write_text(identified_yaml(FOUND, CAMERA))
    loop = load_study([file]).simulate.loop
    assert (loop.actuator.level, loop.sensor.level) == ("tendon", "camera")
    assert loop.actuator.friction == 0.055 and loop.sensor.noise_deg == 0.07


def test_sheaths_may_have_friction_where_a_bend_adds_none() -> None:
    """Friction of a straight and of a bent wrist's tendons stay what they were found."""
    own = tendons_of_values(FOUND | {"friction": 0.0})
    assert own["friction"] < 1e-6 and own["friction"] * own["sheath"] == pytest.approx(0.11)
    assert tendons_of_values(FOUND | {"sheath_friction": 0.0})["sheath"] == 0.0


def test_what_identification_hands_out_cannot_be_changed() -> None:
    assert changeable(wristctl.identification) == []
