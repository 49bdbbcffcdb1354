"""Shares of worlds against published intervals, and performance profiles against their definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import binom

from wristctl.arrays import Array
from wristctl.comparison.tie_groups import performance_profiles, share


@pytest.mark.parametrize(
    ("count", "n", "low", "high"),
    [(81, 263, 0.2527, 0.3676), (15, 148, 0.0578, 0.1617), (0, 20, 0.0000, 0.1684), (1, 29, 0.0009, 0.1776)],
)
def test_intervals_are_those_that_newcombe_printed(count: int, n: int, low: float, high: float) -> None:
    """R. G. Newcombe, Stat. Med. 17 (1998) 857, table I, method 5."""
    found = share(np.arange(n) < count)
    assert (found.low, found.high) == pytest.approx((low, high), abs=5e-5)
    assert (found.times, found.n) == (count, n) and found.value == pytest.approx(count / n)


def test_intervals_of_shares_hold_the_truth_as_often_as_they_say() -> None:
    """Exactly: the chance of each count times whether its interval holds, over shares from 2 to 98 %."""
    n = 60
    ends = np.array([(found.low, found.high) for k in range(n + 1) if (found := share(np.arange(n) < k))])
    truth = np.linspace(0.02, 0.98, 97)[:, None]
    held = (binom.pmf(np.arange(n + 1), n, truth) * ((ends[:, 0] <= truth) & (truth <= ends[:, 1]))).sum(axis=1)
    assert held.min() >= 0.95 and held.mean() < 0.975, "never less often, and little more"


def test_profiles_are_the_shares_within_a_factor_of_the_best() -> None:
    scores = np.array([[1.0, 4.0, 3.0, np.inf], [2.0, 2.0, 3.0, np.nan], [8.0, np.inf, 3.3, np.inf]])
    expected = [[0.5, 0.75, 0.75], [0.5, 0.75, 0.75], [0.0, 0.25, 0.5]]
    np.testing.assert_array_equal(performance_profiles(scores, [1.0, 2.0, 10.0]), expected)


@settings(max_examples=50, deadline=None)
@given(arrays(float, (3, 12), elements=st.floats(0.01, 100.0)), st.integers(0, 2))
def test_profiles_rise_end_at_the_share_solved_and_do_not_mind_each_worlds_unit(scores: Array, failing: int) -> None:
    scores[failing, :4] = np.inf
    factors = np.array([1.0, 1.5, 3.0, 1e9])
    found = performance_profiles(scores, factors)
    assert (np.diff(found, axis=1) >= 0.0).all() and found[:, 0].sum() > 1.0 - 1e-12
    np.testing.assert_array_equal(found[:, -1], np.isfinite(scores).mean(axis=1))
    np.testing.assert_array_equal(performance_profiles(scores * 2.0 ** np.arange(12.0), factors), found)
