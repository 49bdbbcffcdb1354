"""Circles of a wrist with friction: what a turn takes, how far the bend comes behind, and what symmetry asks for."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.commands.analyse.hysteresis_results import Hysteresis
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.hysteresis_circles import HysteresisCircle, check_circles, circles

pytestmark = pytest.mark.slow
RADIUS, FREQUENCY = 10.0, 0.1
SETTINGS = {"circles_deg": (RADIUS,), "frequencies": (FREQUENCY,), "segments": 1}


@cache
def around(tendons: str = "four") -> dict[float, HysteresisCircle]:
    """Circles by their sheath; at -1 that without friction."""
    settings = HysteresisSettings.model_validate(SETTINGS | {"frictions": (0.0, 0.1), "sheaths": (0.0, 2.0)})
    found = circles(WristParameters.model_validate({"tendons": tendons}), settings)
    return {each.case.tendons.sheath if each.case.tendons.friction else -1.0: each for each in found}


@pytest.mark.parametrize("tendons", ["four", "three"])
def test_friction_and_damping_take_what_the_spools_give_in_a_turn(tendons: str) -> None:
    for circle in around(tendons).values():
        assert circle.drift == 0.0 and circle.damped_work > 0.0
        assert circle.raw_work == pytest.approx(circle.friction_work + circle.damped_work, rel=6e-3)


def test_without_friction_the_wrist_goes_around_the_circle_and_damping_takes_its_closed_form() -> None:
    """D (2 pi r)^2 f of one segment that bends by r around, a turn."""
    circle = around()[-1.0]
    apart = np.degrees(np.hypot(*(circle.course.bends - circle.unhindered).T))
    assert apart.max() < 0.1 and circle.friction_work == 0.0 and abs(math.degrees(circle.narrower)) < 0.01
    taken = WristParameters().damping * (2.0 * math.pi * math.radians(RADIUS)) ** 2 * FREQUENCY
    assert circle.damped_work == pytest.approx(taken, rel=0.02)


def test_friction_holds_the_bend_back_along_the_circle_and_more_with_a_sheath() -> None:
    free, bare, sheathed = (around()[sheath] for sheath in (-1.0, 0.0, 2.0))
    assert free.lag < bare.lag < sheathed.lag and free.friction_work < bare.friction_work < sheathed.friction_work
    assert 0.0 < bare.narrower < sheathed.narrower


def test_four_alike_tendons_have_the_same_course_in_every_quarter() -> None:
    bends = around()[2.0].course.bends
    quarter = (len(bends) - 1) // 4
    turned = np.stack([-bends[:, 1], bends[:, 0]], axis=1)
    assert np.degrees(np.abs(bends[quarter:] - turned[: len(bends) - quarter])).max() < 0.01


def test_circles_out_of_range_or_beyond_the_tensions_are_refused() -> None:
    for radius, told in ((80.0, "beyond the wrist's range"), (60.0, "above wrist.tension_limit")):
        settings = HysteresisSettings.model_validate(SETTINGS | {"circles_deg": (radius,)})
        wrist = WristParameters.model_validate({"tension_limit": 8.0, "range_deg": 70.0})
        with pytest.raises(UserError, match=told):
            check_circles(wrist, settings)


def test_a_study_with_circles_has_a_row_a_figure_and_both_bends_of_each(tmp_path: Any) -> None:
    study = wristctl.load_study(
        None, "hysteresis.ranges_deg=[[0, 10]]", "hysteresis.frequencies=[0.5]", "hysteresis.sheaths=[0, 1]",
        "hysteresis.angles_deg=[]", "hysteresis.segments=1", "hysteresis.circles_deg=[10]",
    )  # fmt: skip
    done = wristctl.analyse(study, of="hysteresis", out=tmp_path)
    assert isinstance(done, Hysteresis)
    assert done.run is not None and done.run.problems() == [] and "circles" in done.figures
    rows, courses = done.run.data("circles"), done.run.data("circle_courses")
    assert len(rows) == 2 and len(courses) == 2 * (study.hysteresis.samples + 1)
    for number, circle in enumerate(done.circles):
        own = courses[courses.circle == number]
        np.testing.assert_array_equal(own[["bend_ulnar", "bend_flexion"]], circle.course.bends)
        assert rows.lag[number] == circle.lag and rows.friction_work[number] == circle.friction_work
    told = next(note for note in map(str, done.answer.notes) if "circle of 10 deg" in note)
    assert f"{1e3 * done.circles[1].friction_work:.3g} mJ a turn" in told
    with pytest.raises(UserError, match="identify does not read hysteresis"):
        wristctl.identify(runs="x.csv", model="hysteresis", hysteresis={"circles_deg": [10]})  # type: ignore[call-arg]
