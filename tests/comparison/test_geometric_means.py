"""Geometric means and paired ratios: their intervals against theory, another implementation and the truth."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, norm, skew, t

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import (  # fmt: skip
    FEWEST_WORLDS,
    GeometricMean,
    Resampled,
    geometric_mean,
    paired_ratio,
    penalised,
    plain,
)

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
DEXTRO = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0])
LAEVO = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])
"""Student's hours of sleep gained by ten patients (Biometrika 6 (1908) 1), here logarithms of scores."""


def bca(values: Array, alpha: float) -> Array:
    """The ends of Efron's interval of a mean, each with a tail of alpha, by his formulas."""
    n, rng = len(values), np.random.default_rng(5)
    drawn = rng.choice(values, (200_000, n)).mean(axis=1)
    z0 = norm.ppf(np.mean(drawn < values.mean()) + 0.5 * np.mean(drawn == values.mean()))
    a = skew(values) / (6.0 * np.sqrt(n))  # the jackknife's acceleration of a mean
    z = z0 + norm.ppf([alpha, 1.0 - alpha])
    found: Array = np.quantile(drawn, norm.cdf(z0 + z / (1.0 - a * z)))
    return found


def test_students_sleep_data_have_the_interval_of_efrons_formulas() -> None:
    found = paired_ratio(np.exp(LAEVO), np.exp(DEXTRO), seed=1)
    assert np.log(found.value) == pytest.approx(1.58)
    widened = float(norm.sf(np.sqrt(10 / 9) * t.ppf(0.975, 9)))
    np.testing.assert_allclose(np.log([found.low, found.high]), bca(LAEVO - DEXTRO, widened), atol=0.03)
    assert found.level == 0.95 and not found.is_one


def test_of_normal_logarithms_the_interval_is_students() -> None:
    logs = norm.ppf((np.arange(60) + 0.5) / 60) + 3.0
    found = geometric_mean(np.exp(logs), seed=2)
    half = t.ppf(0.975, 59) * logs.std(ddof=1) / np.sqrt(60)
    np.testing.assert_allclose(np.log([found.low, found.value, found.high]), [3 - half, 3, 3 + half], atol=0.01)


@pytest.mark.parametrize("level", [0.8, 0.95, 0.99])
def test_a_wider_level_has_a_wider_interval(level: float) -> None:
    found = geometric_mean(np.exp(LAEVO), seed=2, level=level)
    less = geometric_mean(np.exp(LAEVO), seed=2, level=level - 0.05)
    assert found.low < less.low < found.value < less.high < found.high and found.value == less.value


def worlds(kind: str, rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Logarithms with a mean of 0."""
    if kind == "skewed":
        return rng.gamma(4.0, 0.5, shape) - 2.0
    return rng.standard_normal(shape)


@pytest.mark.parametrize("kind", ["normal", "skewed"])
@pytest.mark.parametrize("n", [12, 24, 60] if THOROUGH else [24])
@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(kind: str, n: int) -> None:
    """Within 2 % of 95 %, and what chance does to so many trials."""
    trials = 10_000 if THOROUGH else 600
    rng, held = np.random.default_rng(n), 0
    for seed in range(trials // 100):
        low, high = Resampled(worlds(kind, rng, (100, n)), seed).intervals()
        held += int(((low <= 0.0) & (high >= 0.0)).sum())
    print(f"{kind}, {n} worlds: {held / trials:.4f}")
    least, most = (binom.ppf(p, trials, share) for p, share in ((0.001, 0.93), (0.999, 0.97)))
    assert least <= held <= most


scores = st.lists(st.floats(0.01, 50.0), min_size=9, max_size=20)


@settings(max_examples=12, deadline=None)
@given(scores, st.integers(0, 2**32))
def test_exchanged_rows_have_the_reciprocal_ratio_and_units_do_not_matter(values: list[float], seed: int) -> None:
    one, other = np.array(values), np.random.default_rng(seed).uniform(0.1, 9.0, len(values))
    there, back = paired_ratio(one, other, seed), paired_ratio(other, one, seed)
    np.testing.assert_allclose(
        [there.value, there.low, there.high], [1 / back.value, 1 / back.high, 1 / back.low], rtol=1e-3
    )
    assert there.value * back.value == pytest.approx(1.0)
    degrees = paired_ratio(57.3 * one, 57.3 * other, seed)
    np.testing.assert_allclose(degrees, there, rtol=1e-9)
    mean = geometric_mean(one, seed)
    np.testing.assert_allclose(geometric_mean(57.3 * one, seed)[:3], 57.3 * np.array(mean[:3]), rtol=1e-9)
    assert mean.low <= mean.value <= mean.high


def test_the_same_seed_gives_the_same_bits_and_companions_do_not_matter() -> None:
    rows = np.random.default_rng(0).standard_normal((5, 20))
    together = Resampled(rows, 7).intervals()
    np.testing.assert_array_equal(together, Resampled(rows, 7).intervals())
    np.testing.assert_allclose(together[:, 3:4], Resampled(rows[3], 7).intervals(), rtol=0, atol=1e-14)
    assert (together != Resampled(rows, 8).intervals()).all()


def test_rows_that_differ_alike_everywhere_need_no_interval_and_rounding_is_no_difference() -> None:
    one = np.random.default_rng(0).uniform(1.0, 2.0, 20)
    assert paired_ratio(2.0 * one, one, 1) == pytest.approx((2.0, 2.0, 2.0, 0.95), rel=1e-9)
    assert paired_ratio(one * (1.0 + 1e-15), one, 1) == GeometricMean(1.0, 1.0, 1.0, 0.95)


def test_a_row_that_differs_nowhere_leaves_the_others_their_intervals() -> None:
    rows = np.random.default_rng(3).standard_normal((2, 12))
    alone, beside = Resampled(rows, 7).intervals(), Resampled(np.insert(rows, 1, 0.25, axis=0), 7).intervals()
    np.testing.assert_allclose(beside[:, [0, 2]], alone, rtol=0.0, atol=1e-14)
    assert beside[:, 1].tolist() == [0.25, 0.25] and (alone[0] < rows.mean(axis=1)).all()
    assert (alone[1] > rows.mean(axis=1)).all()
    assert np.isfinite(Resampled(rows[:, :FEWEST_WORLDS], 7).intervals()).all()


def test_an_error_too_small_to_measure_counts_as_the_least_and_a_failure_as_a_right_angle() -> None:
    assert np.degrees(penalised([1e-9, 1.0, np.inf])) == pytest.approx([0.001, np.degrees(1.0), 90.0])


@pytest.mark.parametrize(("ratio", "told"), [(0.34721, "0.347"), (8.512, "8.51"), (999.4, "999"), (8676.4, "8676")])
def test_a_ratio_is_told_to_three_digits_and_never_as_a_power_of_ten(ratio: float, told: str) -> None:
    assert plain(ratio) == told


def test_a_ratio_may_be_one_where_its_interval_reaches_that() -> None:
    ends = [(0.5, 0.99), (0.5, 1.0), (0.9, 1.1), (1.0, 2.0), (1.01, 2.0)]
    assert [GeometricMean(1.0, low, high, 0.95).is_one for low, high in ends] == [False, True, True, True, False]


def test_too_few_worlds_know_no_interval() -> None:
    few = paired_ratio(np.full(FEWEST_WORLDS - 1, 3.0), np.full(FEWEST_WORLDS - 1, 1.0), 1)
    assert few.value == pytest.approx(3.0) and (few.low, few.high) == (0.0, np.inf) and few.is_one


def test_a_failure_counts_as_what_it_is_said_to_and_nothing_as_worse() -> None:
    found = penalised([[1.0, np.inf, np.nan, 49.0, 70.0]], failure=50.0)
    np.testing.assert_array_equal(found, [[1.0, 50.0, 50.0, 49.0, 50.0]])
    for wrong, failure in (([1.0, 0.0], 50.0), ([1.0, -1.0], 50.0), ([1.0, 1.0], 0.0)):
        with pytest.raises(ValueError, match="positive"):
            penalised(wrong, failure)
