"""Causes by direction: where the wrist is off its motors says which tendon it is, or that something pushes it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.trial.causes_in_space import SpatialEvidence, causes_in_space
from wristctl.trial.rig_belief import pull_directions
from wristctl.wrist.directions import ACTIVE


def of(**seen: Any) -> list[str]:
    nothing = {name: np.zeros(2) for name in ("load", "apart", "bent", "meant", "jump")}
    pulls = {"turned": np.zeros(4), "torque": np.full(4, 1.0)}
    return causes_in_space(SpatialEvidence(**{**nothing, **pulls, **seen}))


def toward(degrees: float, size: float = 1.0) -> np.ndarray:
    return size * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


@pytest.mark.parametrize("axis", range(4))
@pytest.mark.parametrize("aside", [-15.0, 0.0, 15.0])
def test_a_load_away_from_a_tendons_place_is_that_tendon_lost(axis: int, aside: float) -> None:
    away = math.degrees(pull_directions()[axis]) + 180.0 + aside
    causes = of(load=toward(away))
    assert f"the tendon of axis {axis} (tendon {ACTIVE[axis]}) is off its pulley" in causes[0]
    assert "is caught" in causes[1] and "something pushes the wrist" in causes[-1]


def test_without_a_load_the_bend_alone_says_it() -> None:
    assert "tendon 5) is off its pulley" in of(apart=toward(225.0, 0.06))[0]


def test_a_tendon_that_hardly_pulled_and_one_that_is_paid_out_against_the_load_are_told_apart() -> None:
    torque, turned = np.array([1.0, 1.0, 1.0, 0.01]), np.array([-200.0, 0.0, 0.0, 0.0])
    assert (
        "tendon 1) is caught, or its motor turns the wrong way" in of(load=toward(225), torque=torque, turned=turned)[0]
    )


@pytest.mark.parametrize(("degrees", "word"), [(0, "ulnar"), (90, "flexion"), (180, "radial"), (270, "extension")])
def test_a_load_along_a_plane_is_no_single_tendons(degrees: float, word: str) -> None:
    causes = of(load=toward(degrees))
    assert causes[0].startswith("motors of tendons ") and "exchanged" in causes[0]
    assert causes[-1].startswith(f"something pushes the wrist toward {word}")


def test_a_jump_before_one_camera_alone_is_its_markers() -> None:
    causes = of(jump=np.array([0.0, 0.06]), load=toward(225))
    assert causes[0] == "the marker before the flexion camera has slipped on its disc"
    both = of(jump=np.array([0.04, 0.035]), load=toward(225))
    assert "tendon 5) is off its pulley" in both[0]


def test_a_wrist_that_stands_while_its_motors_turn_has_no_supply_and_one_that_goes_back_is_wired_wrongly() -> None:
    meant = toward(30.0, 0.1)
    assert "no supply" in of(meant=meant, bent=0.05 * meant)[0]
    assert "goes the other way" in of(meant=meant, bent=-0.5 * meant)[0]


def test_a_trial_with_a_push_names_it_first_and_a_loop_that_swings_too() -> None:
    causes = of(load=toward(225), pushed=True, reversals=4)
    assert causes[0].startswith("this trial's push") and causes[1].startswith("the loop swings")
    assert not any("something pushes" in cause for cause in causes)
