"""What a fit of friction tells, of coordinates and their covariance: values in their own units with 95 % intervals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.identification.test_loop_problem import FREED, INSIDE, WRIST, problem
from wristctl.identification import friction_fit
from wristctl.identification.friction_fit import FrictionEstimate, FrictionFit, fit_in_turn
from wristctl.identification.loop_problem import (
    EXPONENT,
    INNER,
    INNER_PRESLIDING,
    PRESLIDING,
    RADIUS,
    SHARE,
    SPOOL_MINUS,
    SPOOL_PLUS,
    STIFFNESS,
    SUPPOSITIONS,
    LoopProblem,
)

HALF = 1.959964
"""Of a 95 % interval, in standard deviations."""


def fitted(
    asked: LoopProblem, at: dict[int, float], deviations: dict[int, float], noise: tuple[float, ...] = (1e-3,)
) -> FrictionFit:
    """A fit that ended at these coordinates, with errors that do not go together."""
    x, spread = asked.begin(), np.zeros(asked.count)
    for index, value in at.items():
        x[index] = value
    for index, deviation in deviations.items():
        spread[index] = deviation
    return FrictionFit(asked, x, [np.zeros(3)], np.array(noise), np.diag(spread**2), 0.0)


def test_what_is_found_as_a_factor_has_an_interval_of_factors() -> None:
    at = {STIFFNESS: math.log(1.5), RADIUS: math.log(0.9), PRESLIDING: math.log(2.0), INNER_PRESLIDING: math.log(0.5)}
    fit = fitted(problem(INSIDE), at | {INNER: 0.1}, dict.fromkeys(at, 0.1))
    found = (
        (fit.stiffness, 1.5 * WRIST.stiffness),
        (fit.tendon_radius, 0.9 * WRIST.tendon_radius),
        (fit.presliding, 4e-5),
    )
    factor = math.exp(0.1 * HALF)
    for estimate, value in (*found, (fit.inner_presliding, math.radians(0.5))):
        assert estimate == pytest.approx((value, value / factor, value * factor), rel=1e-6)


def test_slack_is_what_a_side_reels_in_before_it_pulls() -> None:
    fit = fitted(problem(FREED), {SPOOL_PLUS: -2e-4, SPOOL_MINUS: 3e-4}, {SPOOL_PLUS: 1e-5, SPOOL_MINUS: 2e-5})
    assert [side.value for side in fit.slack] == pytest.approx([2e-4, -3e-4])
    for side, deviation in zip(fit.slack, (1e-5, 2e-5), strict=True):
        assert (side.low, side.high) == pytest.approx((side.value - HALF * deviation, side.value + HALF * deviation))
    asked = problem(winch=True)
    assert fitted(asked, {}, {}).slack == []


@pytest.mark.parametrize("together", [-0.9, 0.0, 0.9])
def test_friction_inside_the_wrist_is_as_sure_as_its_bend_and_the_springs_are(together: float) -> None:
    """A torque is the product of both: by a sample of them."""
    fit = fitted(problem(INSIDE), {INNER: 0.1, STIFFNESS: math.log(2.0)}, {INNER: 0.005, STIFFNESS: 0.03})
    fit.covariance[INNER, STIFFNESS] = fit.covariance[STIFFNESS, INNER] = together * 0.005 * 0.03
    block = fit.covariance[np.ix_([INNER, STIFFNESS], [INNER, STIFFNESS])]
    bend, factor = np.random.default_rng(0).multivariate_normal([0.1, math.log(2.0)], block, 40_000).T
    torque = bend * WRIST.stiffness * np.exp(factor)
    found = fit.inner_friction
    assert found is not None and found.value == pytest.approx(0.2 * WRIST.stiffness)
    assert (found.high - found.low) / 2.0 == pytest.approx(HALF * torque.std(), rel=0.03)
    less = fitted(problem(INSIDE), {INNER: 0.001}, {INNER: 0.005}).inner_friction
    assert less is not None and less.low == 0.0 < less.value


def test_friction_inside_the_wrist_is_told_only_where_it_was_looked_for_or_is_given() -> None:
    assert fitted(problem(), {}, {}).inner_friction is None and fitted(problem(), {}, {}).inner_presliding is None
    given = fitted(problem(INSIDE, fix={"inner_friction": 0.03}), {}, {STIFFNESS: 0.1}).inner_friction
    assert given == pytest.approx((0.03, 0.03, 0.03))
    none = fitted(problem(INSIDE, fix={"inner_friction": 0.0}), {}, {})
    assert none.inner_friction is None


def test_a_fit_without_the_tendons_friction_that_is_as_good_widens_what_is_told() -> None:
    """Nothing is then known of how that friction is shared or turns round, and of the rest what either fit has."""
    other = fitted(
        problem(INSIDE._replace(tendons=False)),
        {EXPONENT: 0.0, INNER: 0.3, STIFFNESS: 0.2},
        {STIFFNESS: 0.01, INNER: 0.01},
    )
    alone = fitted(problem(INSIDE), {EXPONENT: 0.4, SHARE: 0.5, INNER: 0.1}, {EXPONENT: 0.01, STIFFNESS: 0.01})
    both = FrictionFit(alone.problem, alone.x, alone.residuals, alone.noise, alone.covariance, 0.0, other)
    assert alone.exponent.low > 0.37 and both.exponent.low == 0.0 and both.exponent.high == alone.exponent.high
    assert both.friction.low == 0.0 == both.told_best[1].low and both.presliding.high == math.inf
    assert both.stiffness.low == alone.stiffness.low and both.stiffness.high == other.stiffness.high
    inner, own, rival = both.inner_friction, alone.inner_friction, other.inner_friction
    assert inner is not None and own is not None and rival is not None
    assert inner == FrictionEstimate(own.value, own.low, rival.high)


def test_mu_and_the_whole_angle_go_against_each_other() -> None:
    """The loop tells their product: what is not known of the share makes one larger and the other smaller."""
    for of_exponent, of_share, together in ((1e-9, 0.1, -1.0), (0.04, 0.05, -math.sqrt(0.5)), (0.4, 1e-6, 0.0)):
        fit = fitted(problem(), {EXPONENT: 0.4, SHARE: 0.5}, {EXPONENT: of_exponent, SHARE: of_share})
        assert fit.correlation == pytest.approx(together, abs=1e-4)


def test_mu_is_as_sure_as_exponent_and_share_are() -> None:
    asked = problem()
    fit = fitted(asked, {EXPONENT: 0.4, SHARE: 0.5}, {EXPONENT: 0.02, SHARE: 0.01})
    assert fit.friction.value == pytest.approx(0.4 * 0.5 / asked.bend)
    half = HALF * math.hypot(0.02 * 0.5, 0.4 * 0.01) / asked.bend
    assert (
        fit.friction.value - fit.friction.low
        == pytest.approx(half)
        == pytest.approx(fit.friction.high - fit.friction.value)
    )
    assert fit.sheath.value == pytest.approx(asked.bend)
    ends = [asked.bend * (1.0 / share - 1.0) for share in (0.5 + 0.01 * HALF, 0.5 - 0.01 * HALF)]
    assert [fit.sheath.low, fit.sheath.high] == pytest.approx(ends, rel=1e-6)


def test_the_worst_of_all_signals_is_the_misfit() -> None:
    asked = problem(pulls=True)
    least = asked.noise
    assert fitted(asked, {}, {}, tuple(least * (2.0, 1.0, 1.5))).misfit == pytest.approx(4.0)
    assert fitted(asked, {}, {}, tuple(least * (1.0, 1.0, 3.0))).misfit == pytest.approx(9.0)


@pytest.mark.parametrize(
    ("misfits", "told"), [((1.9, 9.0, 9.0), [0]), ((2.01, 1.99, 9.0), [0, 1]), ((4.0, 3.0, 2.5), [0, 1, 2]),
                          ((3.0, 2.5, 4.0), [2, 0, 1])],
)  # fmt: skip
def test_more_is_supposed_until_a_fit_leaves_no_more_than_twice_the_noise(
    misfits: tuple[float, ...], told: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where none does, the last is the one that leaves least."""

    def fit(asked: LoopProblem) -> Any:
        which = SUPPOSITIONS.index(asked.supposed)
        return fitted(asked, {}, {}, tuple(asked.noise * math.sqrt(misfits[which])))

    monkeypatch.setattr(friction_fit, "fit_friction", fit)
    assert [SUPPOSITIONS.index(each.problem.supposed) for each in fit_in_turn(problem())] == told


def test_an_estimate_holds_what_lies_between_its_ends() -> None:
    estimate = FrictionEstimate(2.0, 1.0, 3.0)
    assert [estimate.holds(truth) for truth in (0.99, 1.0, 3.0, 3.01)] == [False, True, True, False]


@pytest.mark.parametrize(("excess", "as_good"), [(7.7, True), (7.9, False)])
def test_friction_inside_the_wrist_is_tried_without_that_of_the_tendons(
    excess: float, as_good: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such a fit is kept beside the other where chi-square says nothing against it: 7.81 of three parameters less."""
    tried = list[tuple[bool, float]]()

    def search(asked: LoopProblem, x: np.ndarray, noise: np.ndarray, tolerance: float = 1e-9) -> Any:
        tried.append((asked.supposed.tendons, float(x[EXPONENT])))
        cost = 50.0 + (0.0 if asked.supposed.tendons else 0.5 * excess)
        return friction_fit._Found(x, cost, [np.full(9, 0.002)], [np.zeros((9, asked.count))])

    monkeypatch.setattr(friction_fit, "_starts", lambda asked, noise: [asked.begin()])
    monkeypatch.setattr(friction_fit, "_search", search)
    monkeypatch.setattr(friction_fit, "_covariance", lambda parts, slopes, prior: np.eye(len(prior)))
    fit = friction_fit.fit_friction(problem(INSIDE))
    assert (fit.rival is not None) == as_good and fit.noise == pytest.approx([0.002])
    assert tried[-1] == (False, 0.0) and all(tendons and exponent > 0.0 for tendons, exponent in tried[:-1])
    if fit.rival is not None:
        assert not fit.rival.problem.supposed.tendons and fit.rival.rival is None
    tried.clear()
    assert friction_fit.fit_friction(problem(FREED)).rival is None and all(tendons for tendons, _ in tried)
