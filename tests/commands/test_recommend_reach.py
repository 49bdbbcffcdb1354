"""How far a wrist is asked to bend: what its tendons hold on all but one of twenty rigs, in one plane and in two."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.small_recommendation import RIG, study_of
from wristctl.commands.recommend.expected import FAMILY
from wristctl.commands.recommend.reach import family_of_rigs, reach_deg
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.study_files.load import load_study
from wristctl.wrist.spatial.held_bends import held_all_around, share_held
from wristctl.wrist.tendon_layout import TendonLayout


def test_the_reach_is_the_wanted_angle_or_what_the_tendons_hold_on_the_rigs_that_are_drawn() -> None:
    assert reach_deg(study_of()) == 45.0
    assert reach_deg(study_of("wrist.range_deg=20")) == 20.0
    stiff = [reach_deg(study_of(f"wrist.stiffness={stiffness}")) for stiffness in (2.0, 3.0, 6.0)]
    assert stiff == sorted(stiff, reverse=True) and stiff[-1] < 45.0
    without = study_of("wrist.stiffness=3.0", "recommend.draw={plant.stiffness: x0.7..0.8}")
    assert reach_deg(without) > stiff[1], "springs that are never stiffer than believed"


def test_a_rig_is_held_against_its_load_to_either_side_and_by_its_tendons_from_where_they_are() -> None:
    def reached(draw: str) -> float:
        return reach_deg(study_of("wrist.stiffness=3.0", f"recommend.draw={{{draw}}}"))

    ahead, behind = (reached(f"disturbances.load: [{load}]") for load in (3.0, -3.0))
    assert ahead == behind < reached("disturbances.load: [0.1]"), "the mirror image"
    assert reached("plant.tendon_radius: x0.7..1.0") < reached("plant.tendon_radius: x0.99..1.0") <= 45.0


@pytest.mark.parametrize("planes", [1, 2])
def test_softer_tendons_and_friction_hold_a_wrist_as_a_lower_limit_of_their_tensions_does(planes: int) -> None:
    """By Euler and Eytelwein a pull arrives at exp(-mu (sheath + bend)) of itself, the other side's at its inverse.

    Spools that wind by the stretch that homing measures of soft tendons make up for it.
    """

    def reached(draw: str, *more: str, stretch: str = "believed") -> float:
        bent = [f"recommend.loop.planes={planes}", "recommend.largest_deg=40", "wrist.stiffness=2.0"]
        wound = ["recommend.loop.actuator.friction=0.0", f"hw-run.homing.stretch={stretch}"]
        return reach_deg(study_of(RIG, *bent, *wound, f"recommend.draw={draw}", *more))

    half = ("wrist.tension_limit=30", "wrist.pretension=1.0")
    whole, soft = reached("{}"), reached("{plant.actuator.tendon_stiffness: [x0.5]}")
    assert 5.0 < soft == reached("{}", *half) < whole
    assert reached("{plant.actuator.tendon_stiffness: [x0.5]}", stretch="measured") > soft
    rubs = 0.5
    friction = rubs / (1.0 + math.radians(40.0))
    less, more = 60.0 * math.exp(-rubs), 2.0 * math.exp(rubs)
    rubbed = reached(f"{{plant.actuator.friction: [{friction}], plant.actuator.sheath: [1.0]}}")
    assert soft < rubbed == reached("{}", f"wrist.tension_limit={less}", f"wrist.pretension={more}") < whole


def test_one_rig_in_twenty_may_fall_short_of_the_reach_and_not_two() -> None:
    def reached(*scales: float) -> float:
        every = ", ".join(f"x{scale}" for scale in scales)
        draw = f"recommend.draw={{plant.stiffness: [{every}]}}"
        return reach_deg(study_of("wrist.stiffness=3.0", "recommend.tests=100", draw))

    alike, stiffer = reached(*[1.0] * 50), reached(*[2.0] * 50)
    assert reached(*[1.0] * 49, 2.0) == alike > stiffer == reached(*[1.0] * 40, *[2.0] * 10)


def test_a_wrist_beyond_its_tendons_is_told_so_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="hold the wrist to") as told:
        wristctl.recommend(study_of("wrist.stiffness=60.0"), out=tmp_path)
    assert told.value.exit_code == 2 and not list(tmp_path.iterdir())


@pytest.mark.parametrize(("tendons", "force"), [("three", 0.0), ("three", 0.3), ("six", 0.0)])
def test_in_two_planes_the_reach_is_the_angle_that_is_held_toward_every_side(tendons: Any, force: float) -> None:
    weak = WristParameters(tendons=tendons, tension_limit=16.0 if tendons == "three" else 9.0)
    layout = TendonLayout.of(weak)
    held = held_all_around(weak, layout, force, 45.0)
    around = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    sides = np.stack([np.cos(around), np.sin(around)], axis=-1)
    beyond = [share_held(weak, layout, np.radians(angle) * sides) < 1.0 for angle in (held - 0.5, held + 1.5)]
    assert 5.0 < held < 44.0 and not beyond[0]
    if not force:
        assert beyond[1]
    else:
        assert held < held_all_around(weak, layout, 0.0, 45.0)


@pytest.mark.parametrize("first", [0.0, 90.0])
@pytest.mark.parametrize("tension_limit", [9.8, 13.0, 16.0])
def test_three_tendons_reach_as_far_as_two_of_them_hold_across_the_third(tension_limit: float, first: float) -> None:
    """Their torques fill a hexagon, whose sides are nearest to its middle at a right angle to each tendon."""
    places = tuple({"angle_deg": first + angle} for angle in (0.0, 120.0, 240.0))
    wrist = WristParameters.model_validate({"tendons": places, "tension_limit": tension_limit})
    layout, angles, across = TendonLayout.of(wrist), np.arange(0.0, 46.0), math.radians(first + 90.0)
    bends = np.radians(angles)[:, None] * np.array([math.cos(across), math.sin(across)])
    share = share_held(wrist, layout, bends)
    assert share < 1.0 and held_all_around(wrist, layout, 0.0, 45.0) == math.floor(45.0 * share)


def test_a_recommendation_for_three_tendons_is_planned_in_two_planes_toward_every_side() -> None:
    study = load_study([], ["wrist.tendons=three", "wrist.tension_limit=16"])
    family = family_of_rigs(study, reach_deg(study))
    kinds = {"diagonal", "diagonal-ramp", "diagonal-square", "ellipse"}
    assert {reference.kind for reference in family.references} == kinds
    drawn = {"reference.toward_deg", "reference.ratio", "reference.speed", "disturbances.toward_deg"}
    assert drawn <= set(family.draw)
    assert {case.motion.planes for case in drawn_cases(family, FAMILY, "test", 0, 2, study.wrist)} == {2}
    one = load_study([])
    homed = one.recommend.family(45.0).model_copy(update={"homed": True})
    assert family_of_rigs(one, 45.0) == homed and reach_deg(study) < reach_deg(one)
