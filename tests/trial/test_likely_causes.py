"""Causes by direction: where the wrist is off its motors says which tendon it is, before one sensor or two."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.trial.likely_causes import Evidence, likely_causes
from wristctl.trial.rig_belief import PLANES, pull_directions
from wristctl.trial.rig_words import words_of_board, words_of_rig
from wristctl.wrist.directions import ACTIVE, away_from_camera, away_of


def of(planes: tuple[str, ...] = PLANES, own: bool = False, **seen: Any) -> list[str]:
    """Causes for tendons at the board's four places, or at those of `directions`."""
    directions = seen.setdefault("directions", pull_directions())
    count = len(directions)
    nothing: dict[str, Any] = {name: np.zeros(2) for name in ("load", "apart", "across", "bent", "meant")}
    nothing |= {"turned": np.zeros(count), "torque": np.full(count, 1.0), "jump": np.zeros(len(planes))}
    numbers = tuple(range(1, count + 1)) if own else ACTIVE
    words = (words_of_rig if own else words_of_board)(numbers, planes)
    return likely_causes(Evidence(**{**nothing, "bends": math.radians(1.0), **seen}, words=words))


def in_one(plane: str = "ulnar", positive: str = "right", own: bool = False, **seen: Any) -> list[str]:
    """The same before one camera; loads, bends and jump are of its plane, `across` is away from it."""
    along = np.array([plane == name for name in PLANES], float)
    pairs = {name: seen.pop(name) * along for name in ("load", "apart", "bent", "meant") if name in seen}
    across = seen.pop("across", 0.0) * away_from_camera(plane, positive)
    return of((plane,), own, across=across, jump=np.array([seen.pop("jump", 0.0)]), **pairs, **seen)


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
    causes = of(load=toward(225), torque=torque, turned=turned)
    assert causes[0] == "axis 0 (tendon 1) turns the wrong way, or its tendon is caught"
    assert causes[1] == "motors exchanged" and "tendon 5) is off its pulley" in causes[2]


@pytest.mark.parametrize(("degrees", "word"), [(0, "ulnar"), (90, "flexion"), (180, "radial"), (270, "extension")])
def test_a_load_along_a_plane_is_no_single_tendons(degrees: float, word: str) -> None:
    causes = of(load=toward(degrees))
    assert causes[0].startswith("motors of tendons ") and "exchanged" in causes[0]
    assert causes[-1].startswith(f"something pushes the wrist toward {word}")


def test_a_jump_before_one_camera_of_two_is_its_markers_and_before_the_only_one_it_may_be() -> None:
    causes = of(jump=np.array([0.0, 0.06]), load=toward(225))
    assert causes[0] == "the marker before the flexion camera has slipped on its disc"
    assert not any("pushes" in cause for cause in causes), "the other camera saw no blow"
    both = of(jump=np.array([0.04, 0.035]), load=toward(225))
    assert "tendon 5) is off its pulley" in both[0]
    one = in_one(jump=0.1)
    assert one[0] == "the tip's marker has slipped on its disc" and "pushes the wrist" in one[-1]
    assert "pulley" not in " ".join(in_one(jump=0.1, across=0.05, load=1.0)), "a size that jumps tells nothing"


@pytest.mark.parametrize("degrees", [30.0, 200.0])
def test_a_wrist_that_stands_while_its_motors_turn_has_no_supply_and_one_that_goes_back_is_wired_wrongly(
    degrees: float,
) -> None:
    meant = toward(degrees, 0.1)
    assert of(meant=meant)[0] == "the motors have no supply, or both cameras show old pictures"
    assert "goes the other way" in of(meant=meant, bent=-0.5 * meant)[0]
    sign = math.copysign(0.2, meant[0])
    assert in_one(meant=sign)[0] == "the motors have no supply, or the camera shows old pictures"
    assert "turn the wrong way" in in_one(meant=sign, bent=-0.75 * sign)[0]


@pytest.mark.parametrize(("share", "much"), [(2.0, "more"), (0.5, "less"), (1.1, "")])
def test_a_wrist_that_bends_where_its_motors_bend_it_by_another_share_has_another_pulley_or_microsteps(
    share: float, much: str
) -> None:
    told = f"the wrist bends by {much} than its spools say: wrong pulley or microsteps (DIP switches)"
    one = in_one(meant=-0.2, bent=-0.2 * share, load=0.1)
    both = of(meant=toward(60.0, 0.2), bent=share * toward(60.0, 0.2), load=toward(90.0))
    assert (one[0] == told) is (both[0] == told) is bool(much)
    askew = of(meant=toward(0.0, 0.2), bent=share * toward(0.0, 0.2) + toward(90.0, 0.2), load=toward(90.0))
    assert not any("spools say" in cause for cause in askew)


def test_a_trial_with_a_push_names_it_first_and_a_loop_that_swings_too() -> None:
    causes = of(load=toward(225), pushed=True, reversals=4)
    assert causes[0].startswith("this trial's push") and causes[1].startswith("the loop swings")
    assert not any("something pushes" in cause for cause in causes)
    assert "swings" in in_one(reversals=3)[0] and "swings" in in_one(across=0.05, load=1.0, reversals=5)[0]
    assert not any("swings" in each for each in (*in_one(reversals=2), *in_one(across=0.05, load=1.0)))


def test_a_push_comes_first_where_the_trial_has_one_and_last_where_none_is_meant() -> None:
    evidence: list[dict[str, Any]] = [{"load": 1.0}, {"across": 0.05, "load": 1.0}, {"jump": 0.1}]
    for seen in evidence:
        pushed, alone = in_one(pushed=True, **seen), in_one(**seen)
        assert pushed[0].startswith("this trial's push was harder") and pushed[1:] == alone[:-1]
        assert "pushes the wrist" in alone[-1]


def test_tendons_that_pull_away_from_the_camera_are_those_on_its_far_side() -> None:
    assert away_of("ulnar", "right") == (-1, 1, -1, 1), "toward flexion, behind a plane whose ulnar is to the right"
    assert away_of("flexion", "right") == (1, 1, -1, -1) and away_of("ulnar", "left") == (1, -1, 1, -1)


@pytest.mark.parametrize(
    ("load", "across", "little", "much"),
    [(-1.0, 0.05, "axis 2 (tendon 4)", "axis 1 (tendon 2)"), (-1.0, -0.05, "axis 3 (tendon 5)", "axis 0 (tendon 1)"),
     (1.0, 0.05, "axis 0 (tendon 1)", "axis 3 (tendon 5)"), (1.0, -0.05, "axis 1 (tendon 2)", "axis 2 (tendon 4)")],
)  # fmt: skip
def test_load_and_bend_across_together_tell_which_tendon(load: float, across: float, little: str, much: str) -> None:
    """One that pulls too little, or the one at the other corner too much."""
    lost = f"the tendon of {little} is off its pulley, cut or slipped, or its motor has stalled"
    wrong = f"{much} turns the wrong way, or its tendon is caught"
    at_rest = in_one(load=load, across=across)
    assert at_rest[:2] == [lost, wrong] and "pushes" in at_rest[2]
    turned = np.zeros(4)
    turned[int(much[5])] = -100.0
    moving = in_one(load=load, across=across, turned=turned, torque=np.zeros(4))
    assert moving[:3] == [wrong, "motors exchanged", lost]


def test_a_motor_that_is_told_to_reel_in_where_its_tendon_lets_go_may_turn_the_wrong_way() -> None:
    """Of the axis that the load is away from; one that stood, or was told to pay out, has not."""
    for steps, told in ((100.0, True), (0.0, False), (-100.0, False)):
        turned = np.array([0.0, 0.0, steps, 0.0])
        for causes in (in_one(load=-1.0, across=0.05, turned=turned), of(load=toward(135.0), turned=turned)):
            assert "the tendon of axis 2 (tendon 4) is off its pulley" in causes[0]
            assert (causes[1] == "axis 2 (tendon 4) turns the wrong way") is told


@pytest.mark.parametrize("axis", range(4))
@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("positive", ["right", "left"])
def test_one_camera_names_the_tendon_that_two_name(axis: int, plane: str, positive: str) -> None:
    """A lost tendon leaves a load away from its place, of which one camera sees a component, and the side across."""
    load = toward(math.degrees(pull_directions()[axis]) + 180.0)
    along, away = np.array([plane == name for name in PLANES], float), away_from_camera(plane, positive)
    one = in_one(plane, positive, load=float(load @ along), across=0.05 * float(load @ away))
    assert one == of(load=load)


def test_without_a_bend_across_one_camera_names_sides_alone() -> None:
    for load, plus, minus in ((1.0, "4 and 5", "1 and 2"), (-1.0, "1 and 2", "4 and 5")):
        causes = in_one(load=load, across=0.4 * math.radians(1.0))
        assert causes[0] == f"motors of tendons {plus} exchanged with those of tendons {minus}"
        assert causes[1].startswith(f"a motor of tendons {minus} has stalled")
    three = in_one(own=True, load=1.0, directions=np.radians([0.0, 120.0, 240.0]))
    assert three[0] == "motors of tendon 1 exchanged with those of tendons 2 and 3"


def test_an_oblique_camera_is_named_where_the_bend_across_may_be_its_own() -> None:
    for across, oblique, first in ((1.5, 6.0, True), (-1.5, 6.0, True), (2.0, 6.0, False), (1.5, 0.0, False)):
        causes = in_one(across=math.radians(across), oblique=math.radians(oblique), load=1.0)
        assert ("does not look square" in causes[0]) is first and "off its pulley" in causes[first]


def test_a_rig_of_ones_own_has_targets_and_a_sensor_and_no_markers_or_pulleys_to_set() -> None:
    angles = np.radians([90.0, 210.0, 330.0])
    lost = "the tendon of target 1 is off its pulley, cut or slipped, or its motor has stalled"
    assert of(own=True, load=toward(270.0), directions=angles)[0] == lost, "no tendon is opposite"
    caught = of(own=True, load=toward(210.0), directions=angles)
    assert caught[0] == "target 2 turns the wrong way, or its tendon is caught" and "pushes" in caught[1]
    between = of(own=True, load=toward(240.0), directions=angles)
    assert between[0] == "motors of tendon 2 exchanged with those of tendon 1"
    assert of(own=True, jump=np.array([0.1, 0.0]))[0] == "the sensor of the bend toward ulnar has slipped"
    seen: list[dict[str, Any]] = [{"jump": 0.1}, {"meant": 0.2}, {"meant": 0.2, "bent": 0.4}, {"load": 1.0}]
    said = " ".join(cause for each in seen for cause in in_one(own=True, **each))
    assert "facts.metres_per_unit" in said and "look() gives old bends" in said
    assert not any(word in said for word in ("marker", "camera", "axis", "DIP"))


def test_without_any_direction_nothing_is_blamed_by_one() -> None:
    assert of() == in_one() == ["something pushes the wrist, or holds it"]
