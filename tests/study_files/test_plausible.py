"""Millimetres typed for metres are asked about, and what is meant goes on."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import wristctl
from wristctl.commands.loop_warnings import asked_by, out_of_reach
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.study_files.error_messages import check_sizes
from wristctl.study_files.keys import field_at, unit_of
from wristctl.study_files.load import read_study
from wristctl.study_files.sweeps import check_all_sizes

ASKED = {
    "wrist.length=80": "80 m is 1,000 times the usual: did you mean 0.08?",
    "wrist.tendon_radius=2": "2 m is 100 times the usual: did you mean 0.02?",
    "wrist.hand_offset=6": "did you mean 0.06?",
    "simulate.loop.plant.tendon_radius=1.05": "did you mean x1.05?",
    "simulate.loop.plant.tendon_radius=20": "did you mean 0.02?",
    "simulate.loop.actuator.pulley_radius=7.5": "did you mean 0.0075?",
    "hw-run.bench.plant.length=90": "did you mean 0.09?",
    "tune.loops={own: {plant: {length: 79}}}": "did you mean 0.079?",
    "wrist.tendons=[{angle_deg: 0}, {angle_deg: 120, radius: 13}, {angle_deg: 240}]": "did you mean 0.013?",
    "wrist.length=1e6": "is that meant?",
}


@pytest.mark.parametrize("given", ASKED)
def test_a_length_that_was_hardly_meant_in_metres_is_asked_about(given: str) -> None:
    with pytest.raises(UserError, match="give it in metres, or go on with --force") as refused:
        check_sizes(*read_study([], [given]))
    assert ASKED[given] in refused.value.what
    assert given.partition("=")[0] in str(refused.value) and refused.value.exit_code == 2


@pytest.mark.parametrize(
    "given", ["wrist.length=0.3", "simulate.loop.plant.tendon_radius=x1.05", "wrist.stiffness=80", "seed=7"]
)
def test_what_may_be_meant_is_not(given: str) -> None:
    check_sizes(*read_study([], [given]))


SIZES = {
    "wrist.stiffness": (1e-3, 1e2),
    "simulate.loop.plant.stiffness": (1e-3, 1e2),
    "simulate.loop.stiffness": (1e-3, 1e3),
    "wrist.damping": (None, 10.0),
    "wrist.mass": (None, 20.0),
    "wrist.hand_mass": (None, 20.0),
    "simulate.loop.disturbances.grasp.mass": (None, 20.0),
    "hw-run.payload": (None, 20.0),
    "wrist.tension_limit": (0.1, 1e4),
    "simulate.loop.disturbances.load": (None, 1e3),
    "simulate.loop.disturbances.push.force": (None, 1e3),
    "hw-run.safety.load": (None, 1e3),
}
"""The least and the largest of each that goes on without a question; None: as little as one likes."""


@pytest.mark.parametrize("key", SIZES)
def test_a_size_by_far_out_of_the_usual_is_asked_about_and_the_last_one_within_is_not(key: str) -> None:
    least, most = SIZES[key]
    _, field = field_at(tuple(key.split(".")))
    slack, unit = "wrist.pretension=0.01", re.escape(unit_of(field)) if field else ""
    for within in (most, 1e-6 if least is None else least):
        check_sizes(*read_study([], [slack, f"{key}={within}"]))
    for beyond in (1.01 * most, *([] if least is None else [0.99 * least])):
        with pytest.raises(UserError, match=f"{beyond:g} {unit}.* is not between") as refused:
            check_sizes(*read_study([], [slack, f"{key}={beyond}"]))
        assert f"{most:g}" in refused.value.what and key in str(refused.value) and "--force" in refused.value.fix


def test_a_force_to_the_other_side_is_as_large_and_none_is_no_size() -> None:
    key = "simulate.loop.disturbances.push.force"
    check_sizes(*read_study([], [f"{key}=-1000"]))
    check_sizes(*read_study([], [f"{key}=0"]))
    with pytest.raises(UserError, match="-1010 N is not between"):
        check_sizes(*read_study([], [f"{key}=-1010"]))
    with pytest.raises(UserError, match="give it in metres"):
        check_sizes(*read_study([], ["wrist.length=80"]))


GRAMS: Any = {"wrist": {"hand_mass": 200.0}, "horizon": 0.01}


def test_python_asks_as_the_command_does_and_goes_on_with_a_study_that_was_loaded_by_force(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"95 m is 1,188 times the usual: did you mean 0\.095") as refused:
        wristctl.simulate(wrist={"length": 95.0})
    assert "load_study(..., force=True)" in refused.value.fix and "--force" not in refused.value.fix
    file = tmp_path / "grams.yaml"
    file.write_text("wrist: {hand_mass: 200}\nsimulate: {horizon: 0.01}\n")
    for asked in (lambda: wristctl.load_study(file), lambda: wristctl.simulate(file), lambda: wristctl.tune(**GRAMS)):
        with pytest.raises(UserError, match="200 kg is not between 0 and 20") as of_grams:
            asked()
        assert "force=True" in of_grams.value.fix
    study: Study = wristctl.load_study(file, force=True)
    assert wristctl.simulate(study, horizon=0.02).trajectory.theta.size > 0


def test_values_of_a_sweep_are_asked_about_where_the_command_makes_it() -> None:
    for axis in ("wrist.length=60..140:5", "wrist.length=0.08,80", "loop.plant.length=~70..90:3"):
        with pytest.raises(UserError, match="times the usual") as refused:
            check_all_sizes(*read_study([], [f"sweep=['{axis}']"], "simulate"), "simulate")
        assert axis in refused.value.where
    for meant in ("wrist.length=0.06..0.14:5", "loop.plant.length=x0.9,x1.1", "controller=pid,adrc", "seed=1,200"):
        check_all_sizes(*read_study([], [f"sweep=['{meant}']"], "simulate"), "simulate")
    check_all_sizes(*read_study([], ["sweep=['wrist.length=60..140:5']"]), "hw-run")
    with pytest.raises(UserError, match="60 m"):
        wristctl.simulate(sweep=["wrist.length=60,70"])


def test_a_wrist_that_no_tension_holds_is_warned_of_by_what_would_do() -> None:
    (shortfall,) = out_of_reach(WristParameters(length=95.0), asked_by(Study(), Study().simulate))
    assert "tendon_radius" in shortfall.fix and "tension_limit" not in shortfall.fix
    (heavy,) = out_of_reach(WristParameters(hand_mass=20.0), asked_by(Study(), Study().simulate))
    assert "tension_limit" in heavy.fix
