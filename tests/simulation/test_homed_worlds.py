"""Homed worlds: what a controller knows of its tendons once homing has measured how far they stretch for a bend."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.config.families import Family
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.drawn_worlds import believed_world_of, drawn_cases, streams_of, world_of
from wristctl.simulation.homed_worlds import homed
from wristctl.simulation.motion import Motion
from wristctl.simulation.planes import motion_in
from wristctl.simulation.worlds import World
from wristctl.wrist.lone_tendons import length_per_radian, stiffness_by_length

WEIGHTLESS = WristParameters(gravity=(0.0, 0.0))
RIG: dict[str, Any] = {"control_period": 1e-2, "actuator": {"level": "tendon", "friction": 0.0}}


def rig(**plant: Any) -> Loop:
    return Loop.model_validate(RIG | {"plant": plant})


def told(loop: Loop, wrist: WristParameters = WEIGHTLESS, error: float = 0.0) -> float:
    """Stiffness that the controller of a homed loop believes [N/m]; that of its plant stays."""
    after = homed(wrist, loop, error)
    assert World(after, wrist).actuator == World(loop, wrist).actuator.model_copy()
    assert World(after, wrist).plant == World(loop, wrist).plant
    return after.actuator.tendon_stiffness


@pytest.mark.parametrize("tendons", ["four", "three", "six"])
def test_a_radian_takes_the_tendons_radius_and_a_pull_that_bends_the_springs(tendons: Any) -> None:
    wrist = WEIGHTLESS.model_copy(update={"tendons": tendons})
    radius = wrist.tendon_radius
    assert length_per_radian(wrist) == pytest.approx((radius, wrist.stiffness / radius), rel=1e-9)
    heavy = wrist.model_copy(update={"gravity": (9.81, 0.0)})
    assert length_per_radian(heavy)[1] > 1.1 * wrist.stiffness / radius, "a hanging hand holds the wrist straight"
    falling = wrist.model_copy(update={"gravity": (-9.81, 0.0), "hand_mass": 2.0})
    assert length_per_radian(falling)[1] < 0.0, "an upright one that buckles goes on by itself"


def test_springs_tendons_and_sheaths_come_in_as_the_stretch_that_they_make() -> None:
    assert told(rig()) == pytest.approx(20e3, rel=1e-9)
    for share in (0.85, 1.2):
        assert told(rig(stiffness=f"x{share}")) == pytest.approx(20e3 / share, rel=1e-9)
        assert told(rig(stiffness_scale=share)) == pytest.approx(20e3 / share, rel=1e-9)
        assert told(rig(actuator={"tendon_stiffness": f"x{share}"})) == pytest.approx(20e3 * share, rel=1e-9)
    rubs = rig(actuator={"friction": 0.1, "sheath": 1.5})
    assert told(rubs) == pytest.approx(20e3 * math.exp(-0.15), rel=1e-9)
    longer = told(rig(tendon_radius="x1.02"))
    assert told(rig(tendon_radius="x0.98")) > 20e3 > longer, "a lever that differs is taken for stretch"


def test_what_no_tendon_can_be_is_not_believed() -> None:
    """Less than 0.8 or more than twice what is believed, and what needs no stretch at all.

    A controller's gain rises as that falls: a heavy hand on tendons that sheaths make seem soft would swing.
    """
    assert told(rig(stiffness="x6")) == 16e3 and told(rig(stiffness="x0.1")) == 40e3
    assert told(rig(tendon_radius="x0.8")) == 40e3
    assert stiffness_by_length(15e3, 60.0, 3e-3) == 20e3 and stiffness_by_length(15e3, 60.0, -1e-3) == 30e3
    ideal = Loop(plant=rig(stiffness="x0.7").plant)
    assert homed(WEIGHTLESS, ideal) is ideal, "no spool winds there"


def test_homing_errs_as_the_noise_of_its_camera_does() -> None:
    """Readings of 0.1 deg in means of five, eight along a bend of a degree: 2 % of steps per radian."""
    noisy = {"sensor": {"level": "camera", "noise_deg": 0.1}}
    loop = Loop.model_validate(RIG | noisy)
    rigid, pull = length_per_radian(WEIGHTLESS)
    lengths = [rigid + pull / told(loop, error=side) for side in (-0.2, 0.0, 0.2)]
    assert lengths[1] - lengths[0] == pytest.approx(lengths[2] - lengths[1]) and lengths[1] == pytest.approx(
        rigid + pull / 20e3
    )
    assert 0.015 < (lengths[2] - lengths[1]) / lengths[1] / 0.2 < 0.03
    calm = Loop.model_validate(RIG | {"sensor": {"level": "camera", "noise_deg": 0.0}})
    assert told(calm, error=2.0) == pytest.approx(20e3, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("tendons", ["four", "three"])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    "plant", [{"stiffness": "x0.6"}, {"stiffness": "x0.8", "actuator": {"tendon_stiffness": "x1.4"}}]
)
def test_a_homed_rig_holds_without_feedback_what_is_wanted(tendons: Any, side: float, plant: dict[str, Any]) -> None:
    """Spools that wind as far as homing says leave a small part of the error that believed stretch makes."""
    wrist, loop = WristParameters(tendons=tendons, gravity=(9.81, 0.0)), rig(**plant)
    planes = 1 if tendons == "four" else 2
    asked = Reference(angle_deg=20.0 * side)
    followed: Motion = motion_in(planes, asked, "ulnar", wrist, 2.0, 1e-2, None)
    ends = []
    for each in (loop, homed(wrist, loop)):
        done = follow(controller("feedforward"), np.zeros(0), followed, wrist, each)
        ends.append(math.degrees(float(np.linalg.norm(np.atleast_1d(done.trajectory.error[-1])))))
    assert ends[0] > 0.3 and ends[1] < 0.3 * ends[0], ends


def test_a_family_is_homed_where_it_says_so_and_with_an_error_of_its_own_in_each_world() -> None:
    wrist = WristParameters()
    camera = {"sensor": {"level": "camera", "noise_deg": 0.1}}
    asked: dict[str, Any] = {"loop": RIG | camera, "draw": {"plant.stiffness": "x0.9..1.1"}, "horizon": 1.0}
    family, after = Family.model_validate(asked), Family.model_validate(asked | {"homed": True})
    for number in range(3):
        before = world_of(after, "f", "test", 0, number)
        assert before == world_of(family, "f", "test", 0, number)
        assert believed_world_of(family, "f", "test", 0, number, wrist) == before
        known = believed_world_of(after, "f", "test", 0, number, wrist)
        assert World(known, wrist).plant == World(before, wrist).plant
        assert known.actuator != homed(wrist, before).actuator and -3e-3 <= known.plant.sensor.dated_late <= 5e-3
    cases = drawn_cases(after, "f", "test", 0, 3, wrist)
    assert [case.loop for case in cases] == [believed_world_of(after, "f", "test", 0, k, wrist) for k in range(3)]
    assert len(streams_of(after, "f", "test")) == len(streams_of(family, "f", "test")) + 2


@pytest.mark.parametrize("frames", [1.0, 3.0])
def test_pictures_are_dated_by_the_age_that_the_check_of_a_rig_measures(frames: float) -> None:
    """To within some milliseconds; how late they come stays."""
    camera = {"sensor": {"level": "camera", "frame_rate": 50.0, "delay_frames": 2.0}}
    loop = Loop.model_validate(RIG | camera | {"plant": {"sensor": {"delay_frames": frames}}})
    for late in (0.0, 5e-3, -3e-3):
        known = homed(WEIGHTLESS, loop, 0.0, late)
        assert known.sensor.delay_frames == frames == World(known, WEIGHTLESS).sensor.delay_frames
        assert known.plant.sensor.dated_late == late
    twice = Loop.model_validate(RIG | camera | {"plant": {"sensor": {"delay_frames": "x1.5"}}})
    assert World(homed(WEIGHTLESS, twice), WEIGHTLESS).sensor.delay_frames == 3.0
