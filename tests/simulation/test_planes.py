"""Planes that loops bend in are found: by tendons, motions, and what takes a wrist out of the plane of its motion."""

import logging
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.planes import Asked, left_out, motion_in, planes_of, why_two
from wristctl.study_files.load import load_study

UPRIGHT = WristParameters()
LEVEL = {"gravity": (0.0, 0.0), "gravity_flexion": 9.81}
OBLIQUE = {"flexion_ratio": 1.5, "stiffness_axis_deg": 30.0}


def asked(direction: Any = "ulnar", kind: str = "minimum-jerk", **loop: Any) -> Asked:
    return Asked(Loop.model_validate(loop), Reference.model_validate({"kind": kind}), direction)


@pytest.mark.parametrize(
    ("wrist", "one", "two"),
    [
        (LEVEL, asked("flexion"), asked("ulnar")),
        ({"gravity": (0.0, 9.81)}, asked("radial"), asked("extension")),
        (OBLIQUE | {"stiffness_axis_deg": 90.0}, asked("flexion"), None),
        ({"stiffness_axis_deg": 30.0}, asked(), None),
        (OBLIQUE, None, asked()),
        ({}, asked(plant={"tilt_deg": 10.0}), asked("flexion", plant={"tilt_deg": 10.0})),
        ({}, asked(plant={"stiffness_axis_deg": 30.0}), asked(plant=OBLIQUE)),
        ({}, asked(disturbances={"toward_deg": 60.0}), asked(disturbances={"toward_deg": 60.0, "load": 1.0})),
        ({}, asked("flexion", disturbances={"toward_deg": 270.0, "load": 1.0}), None),
        ({}, None, asked(disturbances={"toward_deg": 270.0, "grasp": {"mass": 0.1}})),
        ({}, asked(plant={"actuator": {"slack": (0.0, 0.0)}}), asked(plant={"actuator": {"slack": (0.0, 1e-3)}})),
        ({}, None, asked(plant={"actuator": {"broken_at": 1.0}})),
        ({}, asked(), asked(kind="circle")),
        ({}, asked(planes=1), asked(planes=2)),
        ({"tendons": "five"}, asked(), asked(kind="dart-thrower")),
        ({"tendons": "three"}, None, asked()),
        ({"tendons": "six"}, None, asked()),
    ],
)
def test_two_planes_are_where_something_leaves_the_plane_of_the_motion(
    wrist: dict[str, Any], one: Asked | None, two: Asked | None
) -> None:
    known = WristParameters.model_validate(wrist)
    if one is not None:
        assert planes_of(known, [one]) == 1 and why_two(known, [one, one]) == ""
    if two is not None:
        assert planes_of(known, [two]) == 2
        assert planes_of(known, [asked("ulnar" if not wrist else two.direction), two]) == 2, "one number for all"


def test_one_plane_is_kept_where_it_is_asked_for_and_says_what_it_leaves_out() -> None:
    level = WristParameters.model_validate(LEVEL)
    assert planes_of(level, [asked(planes=1)]) == 1
    assert "gravity" in left_out(level, [asked("flexion", planes=1), asked("ulnar", planes=1)])
    assert not left_out(level, [asked()]) and not left_out(UPRIGHT, [asked(planes=1)])
    for must in (asked(kind="circle", planes=1), asked(planes=1)):
        with pytest.raises(UserError, match="in two planes, and the loop in one"):
            planes_of(WristParameters(tendons="three"), [must])


def test_a_motion_of_a_plane_of_its_own_bends_in_that_plane() -> None:
    bend = motion_in(2, Reference(kind="adl:mean-flexion"), None, UPRIGHT, 1.0, 1e-2).bend_ref
    assert not bend[:, 0].any() and np.abs(bend[:, 1]).max() > 0.05
    for direction, plane, sign in (("ulnar", 0, 1), ("radial", 0, -1), ("flexion", 1, 1), ("extension", 1, -1)):
        bend = motion_in(2, Reference(angle_deg=20.0), direction, UPRIGHT, 2.0, 1e-2).bend_ref  # type: ignore[arg-type]
        assert np.rad2deg(bend[-1, plane]) == pytest.approx(20.0 * sign) and not bend[:, 1 - plane].any()


@pytest.mark.slow
def test_a_level_forearm_palm_down_pulls_24_newtons_and_says_why(caplog: pytest.LogCaptureFixture) -> None:
    """Ulnar, against gravity toward flexion: what the tendons hold across, one plane leaves out."""
    level = ("wrist.gravity=[0, 0]", "wrist.gravity_flexion=9.81")
    both = wristctl.simulate(load_study([], [*level, "simulate.horizon=2"]))
    assert both.trajectory.planes == 2 and both.metrics["peak_tension"] == pytest.approx(24.0, abs=1.0)
    assert "gravity bends the wrist out of the motion's plane" in " ".join(both.summary)
    with caplog.at_level(logging.WARNING):
        one = wristctl.simulate(load_study([], [*level, "simulate.horizon=2", "simulate.loop.planes=1"]))
    assert one.trajectory.planes == 1 and one.metrics["peak_tension"] == pytest.approx(14.0, abs=1.0)
    assert any("gravity bends" in record.message and "planes: 1" in record.message for record in caplog.records)
