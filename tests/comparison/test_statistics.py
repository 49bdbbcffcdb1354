"""Medians of repetitions, and the order statistics that hold them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from wristctl.comparison.repetition_spread import FEWEST, spread


@pytest.mark.parametrize(("count", "median"), [(1, 10.0), (2, 15.0), (3, 20.0), (4, 25.0), (7, 40.0), (8, 45.0)])
def test_the_median_is_the_middle_or_the_mean_of_both_in_the_middle(count: int, median: float) -> None:
    values = np.random.default_rng(count).permutation(10.0 * np.arange(1, count + 1))
    found = spread(values)
    assert found.median == median and found.n == count


@pytest.mark.parametrize("count", [6, 9, 20, 50])
def test_the_interval_is_the_narrowest_pair_of_order_statistics_that_holds_the_median_with_95_percent(
    count: int,
) -> None:
    """So many on either side, by the binomial: each tail holds at most 2.5 %, and one more would not."""
    found = spread(np.arange(1.0, count + 1.0))
    below = int(found.low) - 1
    assert binom.cdf(below, count, 0.5) <= 0.025 < binom.cdf(below + 1, count, 0.5)
    assert found.high == count - below
    assert found.interval == (found.low, found.high)


def test_fewer_than_six_repetitions_have_no_interval() -> None:
    """All five lie on one side of the median in 1 of 16 cases, all six in 1 of 32."""
    assert FEWEST == 6 and 2.0 * 0.5**5 > 0.05 >= 2.0 * 0.5**6
    five = spread(np.arange(5.0))
    assert five.interval is None and np.isnan([five.low, five.high]).all()
    assert spread(np.arange(6.0)).interval == (0.0, 5.0)


def test_what_never_happened_counts_as_the_largest() -> None:
    once = spread(np.array([3.0, np.nan, 1.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0]))
    assert once.median == 5.0 and once.low == 2.0 and once.high == 8.0
    half = spread(np.array([1.0, np.nan, np.inf, 2.0]))
    assert np.isnan(half.median) and half.n == 4
    often = spread(np.array([1.0, 2.0, 3.0, 4.0, 5.0, np.nan]))
    assert (often.median, often.low) == (3.5, 1.0) and np.isnan(often.high)
    assert np.isnan(spread(np.full(8, np.nan)).median)
