"""Motions that families draw: in both planes, and with corners; each leaf is drawn of the motions that have it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from wristctl.config.families import Family
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.drawn_worlds import asked_of, drawn_cases
from wristctl.simulation.motion import Motion
from wristctl.simulation.planes import motion_in, planes_of
from wristctl.study_files.load import load_study
from wristctl.study_files.shipped import study_file

WRIST = WristParameters()


def moved(planes: int = 2, **reference: Any) -> Motion:
    return motion_in(planes, Reference.model_validate(reference), None, WRIST, 6.0, 1e-3)


def deg(motion: Motion) -> np.ndarray:
    return np.rad2deg(motion.bend_ref)


@pytest.mark.parametrize("kind", ["ellipse", "diagonal", "adl:mean", "adl:all"])
def test_rates_and_accelerations_are_those_of_the_bend_and_all_begins_straight(kind: str) -> None:
    reference: dict[str, Any] = {"kind": kind, "duration": 0.8} | ({"scale": 0.7} if kind == "adl:all" else {})
    rows = moved(**reference).angles.rows.reshape(2, 3, -1)
    assert np.abs(rows[:, :, 0]).max() < 1e-9
    for angle, rate, acceleration in rows:
        np.testing.assert_allclose(np.gradient(angle, 1e-3)[2:-2], rate[2:-2], atol=2e-3)
        np.testing.assert_allclose(np.gradient(rate, 1e-3)[2:-2], acceleration[2:-2], atol=0.2)


def test_an_ellipse_is_as_long_and_wide_as_asked_for_and_turned() -> None:
    bends = deg(moved(kind="ellipse", angle_deg=30, ratio=0.4, toward_deg=50, turn=2))[2000:]
    axis = np.array([np.cos(np.deg2rad(50)), np.sin(np.deg2rad(50))])
    along, across = bends @ axis, bends @ np.array([-axis[1], axis[0]])
    np.testing.assert_allclose((along / 30) ** 2 + (across / 12) ** 2, 1.0, atol=1e-9)


def test_a_diagonal_rests_where_it_is_asked_to_and_a_loop_can_be_seen_to_swing_there() -> None:
    motion = moved(kind="diagonal", angle_deg=20, toward_deg=-120, duration=0.5)
    assert deg(motion)[-1] == pytest.approx([-10.0, -20 * np.sin(np.deg2rad(60))]) and motion.rest == pytest.approx(0.5)


def test_a_task_in_two_planes_is_at_both_ends_in_both_planes_at_once() -> None:
    bends = deg(moved(kind="adl:mean", duration=0.5, scale=1.2))
    assert bends[500] == pytest.approx([18.0, 6.0]) and bends[1000] == pytest.approx([-12.0, -36.0])


def test_corners_go_at_an_even_speed_and_stand_in_between() -> None:
    ramp = moved(1, kind="ramp", angle_deg=-30, duration=0.5)
    assert ramp.rest == pytest.approx(0.5) and np.rad2deg(ramp.theta_ref[[0, 250, 500, -1]]) == pytest.approx(
        [0.0, -15.0, -30.0, -30.0]
    )
    rate = np.rad2deg(ramp.rate_ref)
    assert rate[:500] == pytest.approx(-60.0) and not rate[501:].any()
    square = moved(1, kind="limited-square", angle_deg=20, frequency=0.5, speed=80)
    angles = np.rad2deg(square.theta_ref)
    assert angles[[0, 125, 250, 999, 1250, 1500, 2500]] == pytest.approx([0, 10, 20, 20, 0, -20, 20], abs=1e-6)
    assert np.abs(np.diff(angles)).max() <= 0.080001
    assert set(np.round(np.rad2deg(square.rate_ref))) == {-80.0, 0.0, 80.0}
    with pytest.raises(UserError, match=r"80 deg/s do not go from side to side by 80 deg in 0\.5 s"):
        moved(1, kind="limited-square", angle_deg=40, frequency=1, speed=80)


def test_a_ramp_and_a_square_toward_a_side_are_those_of_one_plane_on_that_line() -> None:
    toward = np.array([np.cos(np.deg2rad(-120)), np.sin(np.deg2rad(-120))])
    moves: dict[str, dict[str, Any]] = {
        "ramp": {"angle_deg": 30, "duration": 0.5},
        "square": {"angle_deg": 20, "frequency": 0.5, "speed": 80},
    }
    for name, given in moves.items():
        line = moved(1, kind="ramp" if name == "ramp" else "limited-square", **given).angles.rows
        rows = moved(kind=f"diagonal-{name}", toward_deg=-120, **given).angles.rows.reshape(2, 3, -1)
        np.testing.assert_allclose(rows, toward[:, None, None] * line, atol=1e-12)
    assert moved(kind="diagonal-ramp", angle_deg=30, duration=0.5).rest == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["ideal", "camera", "handling", "uneven", "two-planes"])
def test_a_shipped_family_asks_for_a_ramp_and_a_square_of_limited_speed_in_every_world(name: str) -> None:
    """Their rate is constant or none: of a ramp until it rests, of a square time and again, at the drawn speed."""
    file = study_file(Path(f"scenarios/{name}"))
    assert file is not None
    family = load_study([file]).families[name]
    cases = drawn_cases(family, name, "test", 0, 4, WRIST)
    count, speeds = len(family.references), set[float]()
    for world in range(4):
        rates = [np.rad2deg(np.hypot(*case.motion.angles.rows.reshape(-1, 3, len(case.motion.time))[:, 1]))
            if case.motion.planes == 2 else np.abs(np.rad2deg(case.motion.rate_ref))
            for case in cases[world * count : (world + 1) * count]]  # fmt: skip
        even = [rate for rate in rates if rate.any() and len(np.unique(np.round(rate[rate > 0.0], 6))) == 1]
        begins = sorted(int(np.sum((rate[1:] > 0.0) & (rate[:-1] == 0.0)) + (rate[0] > 0.0)) for rate in even)
        assert len(even) == 2 and begins[0] == 1 and begins[1] > 1
        speeds |= {float(rate.max()) for rate in even}
    assert len(speeds) == 8


def test_each_leaf_is_drawn_of_the_motions_that_have_it_and_one_that_none_has_is_an_error() -> None:
    draw = {"reference.turn": "2..5", "reference.scale": "0.5..1", "reference.angle_deg": "10..20"}
    drawn = {"draw": draw, "references": ({"kind": "circle"}, {"kind": "adl:mean"})}
    family = Family.model_validate(drawn)
    assert family.drawn_of(0) == ["reference.turn", "reference.angle_deg"]
    assert family.drawn_of(1) == ["reference.scale", "reference.angle_deg"]
    shares = dict.fromkeys(draw, 0.5)
    assert family.motion(0, shares).value("turn") == 3.5 and family.motion(1, shares).value("scale") == 0.75
    with pytest.raises(ValidationError, match=r"cannot draw reference\.speed: there is no such leaf"):
        Family.model_validate(drawn | {"draw": {"reference.speed": "60..120"}})


@pytest.mark.parametrize(("name", "planes"), [("two-planes", 2), ("corners", 1), ("camera", 1)])
def test_a_shipped_family_bends_in_its_planes_with_no_motion_drawn_twice(name: str, planes: int) -> None:
    file = study_file(Path(f"scenarios/{name}"))
    assert file is not None
    family = load_study([file]).families[name]
    cases = drawn_cases(family, name, "test", 0, 6, WRIST)
    assert {case.motion.planes for case in cases} == {planes}
    ends = {(number % len(family.references), case.motion.bend_ref.tobytes()) for number, case in enumerate(cases)}
    fixed = sum(not family.drawn_of(k) or family.references[k].kind == "adl:mean-flexion" for k in
        range(len(family.references)))  # fmt: skip
    assert len(ends) == len(cases) - 5 * fixed
    again = drawn_cases(family, name, "test", 0, 6, WRIST)
    assert [case.motion.bend_ref.tobytes() for case in again] == [case.motion.bend_ref.tobytes() for case in cases]


@pytest.mark.parametrize("name", ["ideal", "camera", "handling", "uneven", "steps"])
def test_families_that_gains_were_shipped_for_stay_in_the_plane_that_they_were_found_in(name: str) -> None:
    file = study_file(Path(f"scenarios/{name}"))
    assert file is not None
    assert planes_of(WRIST, asked_of(load_study([file]).families[name])) == 1
