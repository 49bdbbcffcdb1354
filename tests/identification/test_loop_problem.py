"""The coordinates in which friction is fitted to a measured loop: what each means, and what is known of it before."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from wristctl.config.identify import IdentifySettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.loop_problem import (
    ANGLE_ZERO,
    AS_BELIEVED,
    BEGIN_PRESLIDING,
    DAMPING,
    EXPONENT,
    INNER,
    INNER_PRESLIDING,
    LEAST_SHARE,
    PRESLIDING,
    RADIUS,
    SHARE,
    SPOOL_MINUS,
    SPOOL_PLUS,
    STIFFNESS,
    SUPPOSITIONS,
    TENDON,
    LoopProblem,
    Supposition,
)
from wristctl.identification.measured_loop import MeasuredLoop

WRIST = WristParameters()
TIME = np.arange(0.0, 20.0, 0.02)
BEND = 0.2 - 0.2 * np.cos(np.pi * TIME / 4.0)
SPOOLS = WRIST.tendon_offset * np.stack([BEND, -BEND], axis=1)
FREED, INSIDE = SUPPOSITIONS[1:]


def problem(
    supposed: Supposition = AS_BELIEVED, winch: bool = False, pulls: bool = False, scale: float = 1.0, **more: Any
) -> LoopProblem:
    pulled = np.stack([5.0 + 10.0 * BEND, 5.0 - 10.0 * BEND], axis=1)
    loop = MeasuredLoop("made.csv", scale * TIME, BEND, None if winch else SPOOLS, pulled if winch or pulls else None)
    return LoopProblem(loop, WRIST, IdentifySettings.model_validate(more), supposed)


def test_the_exponent_and_the_bends_share_of_it_are_those_of_the_tendons() -> None:
    """At the mean bend: mu (bend + sheath) and bend/(bend + sheath); presliding and stiffness by factors."""
    asked = problem()
    for exponent, share in ((0.3, 0.4), (0.1, 1.0), (1.0, 0.01)):
        x = asked.begin()
        x[EXPONENT], x[SHARE], x[PRESLIDING], x[TENDON] = exponent, share, math.log(3.0), math.log(0.5)
        tendons = asked.tendons(x)
        assert tendons.friction * (asked.bend + tendons.sheath) == pytest.approx(exponent)
        assert asked.bend / (asked.bend + tendons.sheath) == pytest.approx(share)
        assert tendons.presliding == pytest.approx(3.0 * BEGIN_PRESLIDING)
        assert tendons.tendon_stiffness == pytest.approx(0.5 * asked.settings.known.tendon_stiffness)
    without = problem(winch=True)
    assert without.tendons(without.begin()).tendon_stiffness == without.settings.known.tendon_stiffness


def test_a_search_begins_with_usual_tendons_and_the_wrist_as_it_is_believed() -> None:
    asked = problem(INSIDE)
    x = asked.begin()
    tendons = asked.tendons(x)
    assert (tendons.friction, tendons.sheath) == pytest.approx((0.1, 1.0)) and tendons.presliding == 2e-5
    assert asked.supposed_wrist(x) == WRIST and asked.plant(x).inner_presliding_deg == 1.0
    assert asked.plant(x).inner_friction == pytest.approx(0.05 * WRIST.stiffness), "that which 0.05 rad of bend ask for"
    low, high = asked.bounds()
    assert ((low <= x) & (x <= high)).all()


def test_the_wrist_differs_by_factors_and_friction_inside_it_goes_with_its_springs() -> None:
    asked = problem(INSIDE)
    x = asked.begin()
    x[[STIFFNESS, DAMPING, RADIUS, INNER, INNER_PRESLIDING]] = np.log(2.0), np.log(3.0), np.log(1.1), 0.1, np.log(4.0)
    wrist, plant = asked.supposed_wrist(x), asked.plant(x)
    assert wrist.stiffness == pytest.approx(2.0 * WRIST.stiffness)
    assert wrist.damping == pytest.approx(3.0 * WRIST.damping)
    assert wrist.tendon_radius == pytest.approx(1.1 * WRIST.tendon_radius)
    assert plant.inner_friction == pytest.approx(0.1 * 2.0 * WRIST.stiffness)
    assert plant.inner_presliding_deg == pytest.approx(4.0)
    held = problem(INSIDE, fix={"inner_friction": 0.03})
    assert held.plant(x).inner_friction == 0.03, "in N m, however stiff the springs turn out"


def names(indices: Any) -> set[int]:
    return {int(index) for index in indices}


def test_what_is_searched_for_depends_on_what_is_supposed_and_measured() -> None:
    """Friction inside the wrist only where it is supposed, the radius only where it is freed and spools are known."""
    tendons, common = {EXPONENT, SHARE, PRESLIDING}, {STIFFNESS, DAMPING, ANGLE_ZERO}
    spools = {TENDON, SPOOL_PLUS, SPOOL_MINUS}
    assert names(problem().free) == tendons | common | spools
    assert names(problem(FREED).free) == tendons | common | spools | {RADIUS}
    assert names(problem(INSIDE).free) == tendons | common | spools | {RADIUS, INNER, INNER_PRESLIDING}
    assert names(problem(INSIDE, winch=True).free) == tendons | common | {INNER, INNER_PRESLIDING}
    assert names(problem(INSIDE._replace(tendons=False)).free) == common | spools | {RADIUS, INNER, INNER_PRESLIDING}
    assert [each.tendons for each in SUPPOSITIONS] == [True] * 3
    assert AS_BELIEVED is SUPPOSITIONS[0] and [(one.freed, one.inner) for one in SUPPOSITIONS] == [
        (False, False), (True, False), (True, True)
    ]  # fmt: skip


def test_what_a_study_fixes_is_held_at_its_value() -> None:
    fixed = {"stiffness": 0.8, "tendon_radius": 0.021, "presliding": 5e-5, "inner_friction": 0.02}
    asked = problem(INSIDE, fix=fixed | {"inner_presliding_deg": 0.5})
    x = asked.begin()
    assert not {STIFFNESS, RADIUS, PRESLIDING, INNER, INNER_PRESLIDING} & names(asked.free)
    wrist, plant = asked.supposed_wrist(x), asked.plant(x)
    assert (wrist.stiffness, wrist.tendon_radius) == pytest.approx((0.8, 0.021))
    assert asked.tendons(x).presliding == pytest.approx(5e-5)
    assert (plant.inner_friction, plant.inner_presliding_deg) == pytest.approx((0.02, 0.5))
    none = problem(INSIDE, fix={"inner_friction": 0.0})
    assert not {INNER, INNER_PRESLIDING} & names(none.free) and none.plant(none.begin()).inner_friction == 0.0


def test_what_is_known_beforehand_counts_by_its_deviation_and_less_where_it_is_freed() -> None:
    known: dict[str, Any] = {
        "known": {"stiffness_error": 0.2, "damping_error": 0.5, "tendon_stiffness_error": 0.3}, "zero_error_deg": 0.4,
        "spool_error": 1e-4, "radius_error": 0.02,
    }  # fmt: skip
    asked, freed = problem(**known), problem(FREED, **known)
    with np.errstate(divide="ignore"):
        deviation = 1.0 / asked.prior
    own = {STIFFNESS: 0.2, DAMPING: 0.5, TENDON: 0.3, ANGLE_ZERO: math.radians(0.4), RADIUS: 0.02}
    own |= {SPOOL_PLUS: 1e-4, SPOOL_MINUS: 1e-4}
    assert {index: deviation[index] for index in own} == pytest.approx(own)
    assert np.isinf(deviation[[EXPONENT, SHARE, PRESLIDING, INNER]]).all()
    loose = {STIFFNESS, RADIUS, ANGLE_ZERO, SPOOL_PLUS, SPOOL_MINUS}
    assert names(np.flatnonzero(freed.prior < 0.5 * asked.prior)) == loose
    certain = problem(FREED, known={"stiffness_error": 1.7}, spool_error=0.01).prior
    assert 1.0 / certain[[STIFFNESS, SPOOL_PLUS]] == pytest.approx([1.7, 0.01]), "never better known for being freed"


def test_coordinates_end_where_they_mean_nothing() -> None:
    """No exponent or inner friction below none, and no share beyond the whole."""
    low, high = problem(INSIDE).bounds()
    assert low[[EXPONENT, INNER]].tolist() == [0.0, 0.0] and (low[SHARE], high[SHARE]) == (LEAST_SHARE, 1.0)
    assert low[PRESLIDING] == -high[PRESLIDING] and math.exp(high[PRESLIDING]) == pytest.approx(1e3)
    assert low[INNER_PRESLIDING] == -high[INNER_PRESLIDING] and high[INNER] > 1.0
    assert np.isinf([*low[[STIFFNESS, DAMPING, ANGLE_ZERO]], *high[[RADIUS, TENDON, SPOOL_PLUS]]]).all()


def test_both_tensions_are_fitted_only_where_spools_are_what_moved() -> None:
    """From the first turn on: there the bristles are bent fully, after a stroke longer than the run-up."""
    first = int(np.flatnonzero(TIME >= 4.0 - 1e-9)[0])
    for asked, signals in ((problem(), 1), (problem(pulls=True), 3), (problem(winch=True), 1)):
        assert asked.first == first and [len(signal) for signal in asked.measured] == [len(TIME) - first] * signals
        assert len(asked.noise) == signals
    assert problem().bend == pytest.approx(0.2, rel=0.01)
    assert problem().noise == pytest.approx([math.radians(0.01)]), "no camera is better"
    assert problem(pulls=True).noise[1:] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(("scale", "step"), [(1.0, 1e-3), (2.0, 2e-3), (10.0, 10e-3), (20.0, 20e-3), (50.0, 20e-3)])
def test_a_slow_loop_takes_longer_steps_up_to_20_ms(scale: float, step: float) -> None:
    """Twenty thousand of them in all, as far as that goes."""
    asked = problem(scale=scale)
    assert asked.step == pytest.approx(step, rel=2e-3)
    finer = LoopProblem(asked.loop, WRIST, asked.settings, AS_BELIEVED, 4)
    assert finer.step == pytest.approx(0.25 * asked.step)


def test_a_loop_of_which_too_much_comes_before_the_first_long_turn_is_refused() -> None:
    """The first turn is after 4 s: up to 0.7 of a recording may be lost, no more."""
    for seconds, fits in ((5.8, True), (5.6, False)):
        some = seconds > TIME
        loop = replace(problem().loop, time=TIME[some], angle=BEND[some], spools=SPOOLS[some])
        asked = LoopProblem(loop, WRIST, IdentifySettings())
        if fits:
            assert asked.first == 200
        else:
            with pytest.raises(UserError, match="too little"):
                _ = asked.first
