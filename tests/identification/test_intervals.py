"""Covariances by hand: closed forms of every part, and the whole against plain formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.benches import KNOWN, START, TENDONS
from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.identification.fit import Fit
from wristctl.identification.intervals import (
    Knowledge,
    autocorrelation,
    bandwidth,
    inflation,
    information_of,
    interval,
    inverse,
    knowledge,
    long_run,
    promised,
)
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.identification.problem import SPOOL, ZERO, Coordinate, Problem
from wristctl.identification.unknowns import UNKNOWNS

FREE = ("stiffness", "friction", "delay")
HELD = {name: START[name] for name in UNKNOWNS if name not in FREE}
NOISE = 0.002


def trial(frames: int, run: str = "a") -> MeasuredTrial:
    time = 0.01 * np.arange(frames, dtype=np.float64)
    return MeasuredTrial("", run, "ulnar", KNOWN, time, np.zeros((frames, 4)), time, np.zeros(frames), 0.0)


def ended(slopes: list[Array], residuals: list[Array], **settings: object) -> Fit:
    """A fit that ended at its start with these slopes and residuals, each trial a run."""
    given = IdentifySettings.model_validate({"fix": HELD, "clock_error": 0.0} | settings)
    problem = Problem([trial(len(each), f"run {k}") for k, each in enumerate(slopes)], START, given, TENDONS)
    return Fit(problem, problem.begin(), NOISE, residuals, slopes, 1)


def in_pairs(frames: int) -> Array:
    """+ + - - + + ...: no frame tells anything of the next, and the sum over half a second is nothing."""
    return NOISE * np.tile([1.0, 1.0, -1.0, -1.0], frames // 4)[: frames - 3]


def test_independent_residuals_leave_fishers_covariance_with_what_was_known_before() -> None:
    residual = in_pairs(400)
    slopes = np.random.default_rng(0).standard_normal((len(residual), 8))
    fitted = ended([slopes], [residual])
    known = knowledge(fitted)
    before = np.array([0.0, 0.0, 0.0, 1.0 / np.radians(0.1), *[1.0 / 2e-5] * 4])
    assert [each.kind for each in fitted.problem.coordinates] == [*FREE, ZERO, *[SPOOL] * 4]
    covariance = np.linalg.inv(slopes.T @ slopes / NOISE**2 + np.diag(before**2))
    np.testing.assert_allclose(known.information, np.linalg.inv(covariance), rtol=1e-9)
    np.testing.assert_allclose(known.deviation[:4], np.sqrt(np.diag(covariance))[:4], rtol=0.15)
    np.testing.assert_allclose(known.half_widths, 1.959964 * known.deviation, rtol=1e-6)
    sd = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(known.correlation, covariance / np.outer(sd, sd), atol=1e-9)
    columns = np.vstack([slopes / NOISE, np.diag(before)[3:]])
    assert known.condition == pytest.approx(np.linalg.cond(columns / np.linalg.norm(columns, axis=0)))
    assert known.autocorrelation == pytest.approx(0.0, abs=0.01) and known.effective == len(residual)


def test_frames_that_are_noisier_where_they_tell_more_widen_the_interval_by_the_sandwich() -> None:
    """By hand: no lag is weighed, and the residuals count n/(n - free parameters) times."""
    residual = in_pairs(60)
    residual[30:] *= 0.1
    slopes = (
        np.random.default_rng(1).standard_normal((len(residual), 8)) * np.where(np.arange(57) < 30, 1.0, 0.1)[:, None]
    )
    fitted = ended([slopes], [residual])
    known = knowledge(fitted)
    assert bandwidth(known.autocorrelation, 57.0) <= 1
    j, r, w = slopes / NOISE, residual / NOISE, fitted.problem.prior()
    bread = np.linalg.inv(j.T @ j + np.diag(w**2))
    meat = long_run(j * r[:, None], bandwidth(known.autocorrelation, 57.0)) * 57.0 / 54.0 + np.diag(w**2)
    sandwich = np.sqrt(np.diag(bread @ meat @ bread))
    np.testing.assert_allclose(known.deviation, np.maximum(sandwich, np.sqrt(np.diag(bread))), rtol=1e-6)
    assert (sandwich[:3] > np.sqrt(np.diag(bread))[:3]).any()


def test_residuals_that_last_widen_every_interval_and_count_as_fewer_frames() -> None:
    """Of one sign for thirty frames each: as if one frame alone of them, or of half a second, told anything."""
    rng = np.random.default_rng(2)
    blocks = NOISE * np.repeat(rng.choice([-1.0, 1.0], 40), 30)
    slopes = rng.standard_normal((1200, 8))
    fitted = ended([slopes], [blocks])
    known = knowledge(fitted)
    half_a_second = round(0.5 / float(np.median(np.diff(fitted.problem.trials[0].captured))))
    alike = max(inflation([blocks], 30), inflation([blocks], half_a_second))
    assert half_a_second != 30
    assert 12.0 < alike < 30.0 and known.effective == pytest.approx(1200 / alike) and known.misses_something
    alone = np.sqrt(np.diag(inverse(known.information)))
    assert (known.deviation >= np.sqrt(alike) * alone * (1.0 - 1e-9)).all()
    np.testing.assert_allclose(known.deviation[:3], np.sqrt(alike) * alone[:3], rtol=0.2)


def test_a_trial_is_no_neighbour_of_the_next() -> None:
    one, other = np.array([1.0, 0.0, 2.0]), np.array([3.0, 0.0, 1.0])
    assert autocorrelation([one, other]) == 0.0
    assert autocorrelation([np.array([1.0, 2.0, 3.0]), other]) == pytest.approx((2.0 + 6.0) / (14.0 + 10.0))
    assert autocorrelation([np.ones(1000)]) == 0.97 and autocorrelation([np.tile([1.0, -1.0], 500)]) == -0.97


def test_more_trials_of_the_same_kind_know_more_by_the_root_of_their_number() -> None:
    residual = in_pairs(400)
    slopes = np.random.default_rng(3).standard_normal((len(residual), 8))
    slopes[:, 3:] = 0.0
    once = knowledge(ended([slopes], [residual]))
    own = [np.hstack([slopes[:, :3], np.zeros((len(residual), 20))]) for _ in range(4)]
    often = knowledge(ended(own, [residual] * 4))
    np.testing.assert_allclose(often.deviation[:3], once.deviation[:3] / 2.0, rtol=0.02)


def test_lags_are_weighed_by_andrews_rule() -> None:
    """1.1447 (alpha n)^(1/3), alpha = 4 rho^2/(1 - rho^2)^2; never more than a quarter of a trial."""
    assert bandwidth(0.0, 1000.0) == 0
    for rho in (0.5, -0.5):
        assert bandwidth(rho, 1000.0) == 14  # 1.1447 * 1777.8^(1/3) = 13.87
    assert bandwidth(0.3, 300.0) == 6  # 1.1447 * (0.43473 * 300)^(1/3) = 5.81
    assert bandwidth(0.97, 100.0) == 25


def test_the_covariance_of_a_sum_weighs_neighbours_less_the_further_apart_they_are() -> None:
    scores = np.random.default_rng(4).standard_normal((9, 2))
    for lags in (0, 1, 3, 30):
        wanted = np.zeros((2, 2))
        for i in range(9):
            for j in range(9):
                if abs(i - j) <= lags:
                    wanted += (1.0 - abs(i - j) / (min(lags, 30) + 1.0)) * np.outer(scores[i], scores[j])
        np.testing.assert_allclose(long_run(scores, lags), wanted, atol=1e-12)


def test_inflation_is_of_all_trials_together() -> None:
    """A constant over a lag each way is worth 1 + 2 (1/2) (n - 1)/n of itself; its opposite as much less."""
    same, other = np.ones(5), np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    assert inflation([same], 1) == pytest.approx(1.0 + 4.0 / 5.0)
    assert inflation([other], 1) == pytest.approx(1.0 - 4.0 / 5.0)
    assert inflation([same, other, other], 1) == pytest.approx(1.0 - 4.0 / 15.0)


def test_a_coordinate_without_influence_is_all_but_unknown_and_spoils_no_other() -> None:
    information = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.0], [0.0, 0.0, 0.0]])
    covariance = inverse(information)
    np.testing.assert_allclose(covariance[:2, :2], np.linalg.inv(information[:2, :2]), rtol=1e-6)
    assert 1e12 < covariance[2, 2] < np.inf
    slopes = [np.array([[1.0, 2.0]]), np.array([[0.0, 3.0]])]
    np.testing.assert_allclose(information_of(slopes, np.array([2.0, 0.0])), [[5.0, 2.0], [2.0, 13.0]])


def test_promised_half_widths_are_what_independent_frames_would_leave() -> None:
    slopes = np.random.default_rng(5).standard_normal((50, 8)) / NOISE
    problem = ended([slopes], [np.zeros(50)], clock_error=3e-3).problem
    covariance = np.linalg.inv(slopes.T @ slopes + np.diag(problem.prior() ** 2))
    wanted = np.sqrt(np.diag(covariance))
    wanted[problem.coordinates[Coordinate("delay")]] = np.hypot(wanted[2], 3e-3)
    np.testing.assert_allclose(promised(problem, [slopes]), 1.959964 * wanted, rtol=1e-6)


def test_an_interval_lies_about_the_value_in_its_own_unit() -> None:
    fitted = ended([np.ones((40, 8))], [np.ones(40)])
    x = fitted.x.copy()
    x[:3] = 0.2, 0.3, 0.04
    known = Knowledge(np.array([0.1, 0.01, 0.002, 0, 0, 0, 0, 0]) / 1.959964, np.eye(8), 1.0, 0.0, 1.0, np.zeros(8))
    found = replace(fitted, x=x)
    assert interval(found, known, "stiffness") == pytest.approx(tuple(START["stiffness"] * np.exp([0.1, 0.3])))
    assert interval(found, known, "friction") == pytest.approx((0.29, 0.31))
    assert interval(found, known, "delay") == pytest.approx((0.038, 0.042))
    lost = replace(known, deviation=np.array([1e6, 1.0, 1.0, 0, 0, 0, 0, 0]))
    low, high = interval(found, lost, "stiffness")
    assert 0.0 < low < 1e-20 and 1e20 < high < np.inf
    assert interval(found, lost, "friction")[0] == 0.0 and interval(found, lost, "delay")[0] < -1.0
