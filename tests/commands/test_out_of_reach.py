"""What the tendons cannot hold is said before any work: by loop, motion and side, and with what would do."""

from __future__ import annotations

import logging
import math
import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import wristctl
from tests.commands.conftest import repeated, session
from wristctl.commands import loop_warnings
from wristctl.commands.inputs import Inputs
from wristctl.commands.loop_warnings import OutOfReach, asked_by, out_of_reach
from wristctl.commands.simulate.command import SIMULATE
from wristctl.commands.tune.command import TUNE
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.simulation import closed_loop

OWN = ("wrist.stiffness=6.0", "wrist.length=0.12")
NAMED = r"30 deg .* 2\.99 N m where 60 N give 1\.68"


def study_of(*settings: str) -> Study:
    return wristctl.load_study(None, *OWN, *settings, force=True)


def simulated(*settings: str) -> list[OutOfReach]:
    study = study_of(*settings)
    return out_of_reach(study.wrist, asked_by(study, study.simulate))


def tuned(*settings: str) -> list[OutOfReach]:
    study = study_of(*settings)
    return out_of_reach(study.wrist, asked_by(study, study.tune))


def compared(*settings: str) -> list[OutOfReach]:
    study = study_of(*settings)
    return out_of_reach(study.wrist, asked_by(study, study.compare))


@pytest.mark.parametrize("kind", ["circumduction", "diagonal"])
@pytest.mark.parametrize("limit", [6, 12])
def test_in_two_planes_it_is_said_how_much_of_what_is_asked_is_held(kind: str, limit: int) -> None:
    """Whatever the course of the motion: that much is held, and a little more is not."""
    usual = (f"wrist.tension_limit={limit}", "wrist.stiffness=1.5", f"simulate.reference.kind={kind}")
    (found,) = simulated(*usual)
    match = re.search(rf"tensions of {limit} N hold at most (\S+) of the 30 deg asked", found.what)
    assert match and 0.5 < float(match[1]) < 15.0
    assert not simulated(*usual, f"simulate.reference.angle_deg={match[1]}")
    assert simulated(*usual, f"simulate.reference.angle_deg={1.05 * float(match[1])}")


def test_a_wrist_that_is_far_too_stiff_is_held_hardly_at_all_and_one_that_hangs_not_even_straight() -> None:
    (found,) = simulated("wrist.stiffness=200", "simulate.reference.kind=circumduction")
    assert re.search(r"60 N hold at most 0\.\d+ of the 30 deg asked", found.what)
    heavy = ("wrist.tension_limit=6", "wrist.hand_mass=40", "wrist.gravity_flexion=9.81")
    (found,) = simulated(*heavy, "simulate.reference.kind=circumduction")
    assert "not hold even the straight wrist" in found.what


@pytest.mark.parametrize("direction", ["ulnar", "radial", "flexion", "extension"])
def test_what_would_do_does(direction: str) -> None:
    """As it is printed, rounded to the safe side."""
    toward = f"simulate.direction={direction}"
    (found,) = simulated(toward)
    assert "30 deg" in found.what and "2.99 N m" in found.what and "60 N give 1.68" in found.what
    assert ("direction" not in found.where) and (direction in found.where) == (direction != "ulnar")
    for enough in ("wrist.tension_limit=106", "simulate.reference.angle_deg=16.7", "wrist.tendon_radius=0.0361"):
        leaf, value = enough.split("=")
        assert value in found.fix
        assert not simulated(toward, enough)
        assert simulated(toward, f"{leaf}={float(value) * (1.01 if 'angle' in leaf else 0.99)}")


def test_the_wrist_as_it_is_counts_and_a_loop_without_limits_does_not() -> None:
    assert not simulated("simulate.loop.limits=false")
    assert not simulated("simulate.loop.plant.stiffness_scale=0.5")
    soft = ("wrist.stiffness=3.0",)
    assert not simulated(*soft) and simulated(*soft, "simulate.loop.plant.stiffness=6.0")
    assert not simulated(*soft, "simulate.loop.disturbances.load=5.0")
    assert simulated(*soft, "simulate.loop.disturbances.load=-5.0"), "a load that pushes back"
    assert simulated("simulate.direction=flexion", *soft, "wrist.flexion_ratio=2.0")
    assert not simulated(*soft, "wrist.flexion_ratio=2.0")


def test_the_largest_angle_of_a_motion_is_looked_at_to_either_side() -> None:
    steps = "simulate.reference={kind: multi-step, duration: 0.3, angles_deg: [10, %s, 5]}"
    assert not simulated(steps % 12) and not simulated(steps % -12)
    for angle in (30, -30):
        (found,) = simulated(steps % angle)
        assert f"{angle} deg" in found.what
    tips = "simulate.reference={kind: tip-path, inverse: network, tip_ratios: [[0.99, 0.0], [0.94, %s]]}"
    assert "cannot hold -3" in simulated(tips % -0.283)[0].what and "cannot hold 3" in simulated(tips % 0.283)[0].what


def test_loops_and_motions_alike_are_told_together_and_others_by_themselves() -> None:
    loops = (
        "compare.loops={a: {}, b: {plant_segments: 1}, free: {limits: false}, stiff: {plant: {stiffness_scale: 1.1}}}"
    )
    references = "compare.references=[{kind: step}, {angle_deg: 10}, {duration: 1.0}, {kind: step, angle_deg: 25}]"
    found = compared(loops, references)
    assert [each.where for each in found] == [
        "step 30 deg, minimum jerk 1 s 30 deg on a, b", "step 25 deg on a, b",
        "step 30 deg, minimum jerk 1 s 30 deg on stiff", "step 25 deg on stiff",
    ]  # fmt: skip
    both = compared("compare.loops={a: {}}", "compare.references=[{}]", "compare.directions=[ulnar, radial]")
    assert len(both) == 2 and both[1].where.endswith("30 deg, radial on a")
    searched = "compare.tuning={loops: {own: {}}, scenarios: [{loop: own, reference: {angle_deg: 28}}]}"
    assert compared(searched, "compare.references=[{angle_deg: 5}]")[0].where == "minimum jerk 1 s 28 deg on own"


def test_of_a_family_both_ends_of_what_is_drawn_are_looked_at() -> None:
    family = "families.f={draw: {reference.angle_deg: -35..10}, references: [{}]}"
    for found in (tuned(family, "tune.worlds.family=f"), compared(family, "compare.worlds.family=f")):
        assert len(found) == 1 and "-35 deg" in found[0].what and found[0].where.endswith("on f")


def doubted(*settings: str) -> UserError:
    assert TUNE.doubts is not None
    with pytest.raises(UserError) as caught:
        TUNE.doubts(study_of(*settings), Inputs())
    return caught.value


def test_gains_are_not_searched_where_none_can_help() -> None:
    scenarios = "tune.scenarios=[{reference: {angle_deg: 10}}, {reference: {angle_deg: 30}}]"
    refused = doubted(scenarios)
    assert refused.exit_code == 2 and refused.where == "tune.scenarios" and "--force" in refused.fix
    assert "2.99 N m" in refused.what and "106 N" in refused.fix and "\n" not in str(refused)
    assert doubted("families.f={}", "tune.worlds.family=f").where == "families.f.references"
    assert TUNE.doubts is not None
    TUNE.doubts(study_of(scenarios, "wrist.tension_limit=106"), Inputs())
    TUNE.doubts(wristctl.load_study(None), Inputs())


def test_a_loop_beyond_its_tendons_is_warned_of_before_and_no_gains_are_advised(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    once = repeated("ct-dob/hardware")
    course = once.first.trajectory
    half = replace(course, theta=0.5 * course.theta)
    short = replace(once, first=replace(once.first, trajectory=half))

    def run(study: Study, *others: object) -> object:
        assert not beyond or "cannot hold" in caplog.text, "before any work"
        return short

    monkeypatch.setattr(closed_loop, "simulate", run)
    for beyond in (True, False):
        caplog.clear()
        study = study_of("simulate.controller=ct-dob", *(() if beyond else ("wrist.tension_limit=106",)))
        with caplog.at_level(logging.WARNING):
            said = " ".join(SIMULATE.perform(session(study)).summary)
        assert ("cannot hold" in caplog.text) is beyond
        assert ("106 N" in said and "16.7 deg" in said and "0.0361 m" in said) is beyond
        assert ("`tune` may find gains that do" in said) is not beyond


@pytest.mark.parametrize("family", ["ideal", "camera", "uneven", "handling", "steps"])
@pytest.mark.parametrize("section", ["tune", "compare"])
def test_motions_of_either_plane_can_be_asked_of_a_family_and_all_are_within_reach(family: str, section: str) -> None:
    """Daily living is anatomical: of the flexion plane in `ideal`, whatever direction a command has by default."""
    study = wristctl.load_study(f"experiments/scenarios/{family}.yaml", f"{section}.worlds.family={family}")
    asked = asked_by(study, getattr(study, section))
    assert {one.reference.kind for one in asked} == {one.kind for one in study.families[family].references}
    assert out_of_reach(study.wrist, asked) == []


def test_a_motion_of_the_other_plane_has_no_direction_in_this_one() -> None:
    study = wristctl.load_study(None, "compare.references=[{kind: adl:mean-flexion}]", "compare.directions=[ulnar]")
    with pytest.raises(UserError, match="not in it"):
        asked_by(study, study.compare)


@given(value=st.floats(1e-3, 1e3))
def test_what_would_do_is_rounded_to_three_digits_to_the_side_that_does(value: float) -> None:
    up, down = loop_warnings._rounded(value, math.ceil), loop_warnings._rounded(value, math.floor)
    assert down <= value * (1.0 + 1e-12) and value * (1.0 - 1e-12) <= up <= 1.0101 * value and down >= 0.99 * value
    assert float(f"{up:.3g}") == pytest.approx(up, rel=1e-12) and float(f"{down:.3g}") == pytest.approx(down, rel=1e-12)
