"""Keywords of a function are sections and keys of a study: the same values, and the same errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.study_files.load import load_study, read_study

WRIST = st.fixed_dictionaries(
    {},
    optional={
        "tendons": st.sampled_from(["three", "four", "six"]),
        "length": st.floats(0.01, 1.0),
        "stiffness": st.floats(0.01, 10.0),
        "discs": st.integers(2, 33),
        "gravity": st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)).map(list),
    },
)


@given(WRIST, st.floats(0.5, 9.0), st.sampled_from(["pid-ff", "adrc/hardware", "pid/Kp=1,Ki=2,Kd=0.5"]))
def test_keywords_give_the_study_of_a_file_that_says_the_same(
    wrist: dict[str, Any], horizon: float, controller: str
) -> None:
    keywords = {"wrist": wrist, "horizon": horizon, "controllers": [controller, "ct-dob"], "seed": 3}
    study, _ = read_study(command="compare", keywords=keywords)
    content = {"seed": 3, "wrist": wrist, "compare": {"horizon": horizon, "controllers": [controller, "ct-dob"]}}
    file = Path("written.yaml")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("wristctl.study_files.load.read_plain", lambda path: yaml.safe_dump(content))
        patch.setattr("wristctl.study_files.load.study_file", lambda path, folder=Path(): path)
        assert study == load_study([file])


def test_keywords_come_after_a_study_and_leave_the_rest_of_it() -> None:
    base = load_study([Path("quick")], ["wrist.mass=0.07", "simulate.reference.kind=sine", "seed=5"])
    study, _ = read_study(
        command="simulate", keywords={"wrist": {"length": 0.1}, "reference": {"frequency": 0.25}}, base=base
    )
    assert (study.wrist.mass, study.wrist.length, study.seed) == (0.07, 0.1, 5)
    assert (study.simulate.reference.kind, study.simulate.reference.frequency) == ("sine", 0.25)
    assert study.tune == base.tune and study.compare == base.compare
    assert read_study(command="simulate", keywords={}, base=base)[0] == base


def test_a_controller_by_itself_has_its_own_gains_and_not_those_of_the_study() -> None:
    base = load_study([], ["simulate.controller=pid", "simulate.gains=Kp=1,Ki=2,Kd=3"])
    study, _ = read_study(command="simulate", keywords={"controller": "ct-dob"}, base=base)
    assert study.simulate.controller == "ct-dob" and "gains" not in study.simulate.model_fields_set
    same, _ = read_study(command="simulate", keywords={"gains": {"Kp": 4.0}}, base=base)
    assert same.simulate.gains == {"Kp": 4.0, "Ki": 2.0, "Kd": 3.0}


def test_numbers_and_arrays_of_numpy_paths_and_sections_are_taken() -> None:
    keywords = {
        "wrist": {"length": np.float64(0.09), "discs": np.int64(4), "gravity": np.array([0.0, 9.81])},
        "reference": {"kind": "recording", "file": Path("my.csv")},
    }
    study, _ = read_study(command="simulate", keywords=keywords)
    assert (study.wrist.length, study.wrist.discs, study.wrist.gravity) == (0.09, 4, (0.0, 9.81))
    assert study.simulate.reference.file == str(Path("my.csv").absolute()) or study.simulate.reference.file == "my.csv"
    whole, _ = read_study(command="simulate", keywords={"wrist": WristParameters(mass=0.2)})
    assert whole.wrist.mass == 0.2


def test_the_wrist_of_a_file_is_taken_and_its_other_sections_are_not(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("wrist:\n  length: 0.09\n  mass: 0.06\nsimulate: {horizon: 9.0}\n")
    base = load_study([], ["wrist.length=0.2", "wrist.stiffness=2.0"])
    study, _ = read_study(command="simulate", keywords={"wrist": file}, base=base)
    assert (study.wrist.length, study.wrist.mass, study.wrist.stiffness) == (0.09, 0.06, 2.0)
    assert study.simulate.horizon == base.simulate.horizon
    file.write_text("wrist:\n  length: 0.09\n  mas: 0.06\n")
    with pytest.raises(UserError, match=r"unknown key 'mas' - .*mine.yaml:3: wrist.mas - fix: did you mean 'mass'"):
        read_study(command="simulate", keywords={"wrist": str(file)})
    file.write_text("simulate: {horizon: 9.0}\n")
    with pytest.raises(UserError, match="no section wrist"):
        read_study(command="simulate", keywords={"wrist": str(file)})


@pytest.mark.parametrize(
    ("command", "keywords", "words"),
    [
        ("simulate", {"wrist": {"lenght": 0.09}}, ["'lenght'", "simulate(wrist=...)", "wrist.lenght", "'length'?"]),
        ("simulate", {"wrsit": {}}, ["unknown argument 'wrsit'", "did you mean 'wrist'?"]),
        ("simulate", {"length": 0.09}, ["unknown argument 'length'", "did you mean wrist={'length': ...}?"]),
        ("simulate", {"angle_deg": 5.0}, ["did you mean reference={'angle_deg': ...}?"]),
        ("simulate", {"reference": "circumductoin"}, ["simulate(reference='circumductoin')", "'circumduction'?"]),
        ("tune", {"controllers": ["pid-ff/hardware"]}, ["tune.controllers.0", "fix: the name alone: pid-ff"]),
        ("tune", {"controllers": ["pid-fff/hardware"]}, ["'pid-fff/hardware' is not one of the choices"]),
        ("simulate", {"contoller": "smc"}, ["unknown argument", "did you mean 'controller'?"]),
        ("simulate", {"controller": "ct-dop"}, ["simulate(controller='ct-dop')", "did you mean 'ct-dob'?"]),
        ("simulate", {"train": {"epochs": 3}}, ["simulate does not read train"]),
        ("simulate", {"wrist": {"length": "95 mm"}}, ["simulate(wrist=...)", "wrist.length", "in m"]),
        ("simulate", {"controller": print}, ["is no setting", "my.py:NAME"]),
        ("simulate", {"wrist": {1: 2}}, ["1 is no key"]),
        ("compare", {"controllers": ["smc", "pid-fff"]}, ["compare(controllers=...)", "'pid-ff'?"]),
        ("hw-run", {"push": {"forse": 1.0}}, ["hw_run(push=...)", "hw-run.push.forse", "'force'?"]),
    ],
)
def test_what_no_study_has_is_told_with_the_argument_and_what_was_meant(
    command: str, keywords: dict[str, Any], words: list[str]
) -> None:
    with pytest.raises(UserError) as raised:
        read_study(command=command, keywords=keywords)
    raised.value.in_python = True
    assert not [word for word in words if word not in str(raised.value)], raised.value


def test_a_name_alone_stands_for_a_list_of_one_or_for_a_group_of_that_kind() -> None:
    def read(command: str, **keywords: Any) -> Any:
        return getattr(read_study(command=command, keywords=keywords)[0], command.replace("-", "_"))

    assert read("simulate", reference="circumduction").reference.kind == "circumduction"
    assert read("hw-run", reference="step").reference.kind == "step"
    assert [row.label for row in read("compare", controllers="pid-ff/hardware").rows] == ["pid-ff/hardware"]
    assert read("tune", controllers="adrc").controllers == ("adrc",)
    assert read("compare", directions="radial").directions == ("radial",)
    swept, _ = read_study(command="simulate", keywords={"sweep": "wrist.length=0.08,0.09"})
    assert swept.sweep == ("wrist.length=0.08,0.09",)
    with pytest.raises(UserError, match=r"analyse\.angles_deg"):
        read("analyse", angles_deg="10")
    whole, _ = read_study(command="simulate", keywords={"wrist": {"tendons": "three"}})
    assert whole.wrist.tendons == "three"
