"""Tests between rows against scipy's own, and the intervals of means."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import friedmanchisquare, ttest_1samp, wilcoxon

import wristctl.learning
from tests.values import changeable
from wristctl.learning.ranking import Pair, Ranking, holm, mean_interval, rank


def rows(seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {"worst": 3.0 + rng.random(9), "best": 1.0 + rng.random(9), "middle": 1.5 + rng.random(9)}


def test_rows_are_ranked_by_mean_and_every_pair_is_tested_once_better_first() -> None:
    errors = rows()
    found = rank(errors)
    assert found.order == ("best", "middle", "worst")
    assert [(pair.better, pair.worse) for pair in found.pairs] == [
        ("best", "middle"), ("best", "worst"), ("middle", "worst"),
    ]  # fmt: skip
    raw = [float(wilcoxon(errors[pair.worse] - errors[pair.better]).pvalue) for pair in found.pairs]
    assert [pair.p for pair in found.pairs] == pytest.approx(holm(raw))
    for pair in found.pairs:
        assert pair.difference == pytest.approx(np.median(errors[pair.worse] - errors[pair.better]))
    assert found.friedman_p == pytest.approx(friedmanchisquare(*errors.values()).pvalue)


def test_a_row_is_as_good_as_its_mean_however_many_values_it_has_and_pairs_are_of_whole_rows() -> None:
    found = rank({"a": [1.0, 5.0, 1.0, 5.0], "b": [2.0, 2.5, 2.0, 2.5]})
    assert found.order == ("b", "a") and found.pairs[0].difference == pytest.approx(0.75)


def test_two_rows_have_no_test_of_the_whole_and_equal_ones_no_difference() -> None:
    same = np.arange(1.0, 7.0)
    found = rank({"a": same, "b": same})
    assert np.isnan(found.friedman_p) and [pair.p for pair in found.pairs] == [1.0]
    assert not found.supports_best("a") and not found.supports_best("b")


def test_the_best_must_beat_every_other_row_below_five_per_cent() -> None:
    def ranked(*p: float) -> Ranking:
        return Ranking(
            ("a", "b", "c"), 0.01, (Pair("a", "b", 1.0, p[0]), Pair("a", "c", 1.0, p[1]), Pair("b", "c", 1.0, 0.0))
        )

    assert ranked(0.049, 0.049).supports_best("a")
    assert not ranked(0.051, 0.001).supports_best("a") and not ranked(0.001, 0.051).supports_best("a")
    assert not ranked(0.001, 0.001).supports_best("b")


def test_holm_never_falls_behind_and_never_exceeds_one() -> None:
    np.testing.assert_allclose(holm([0.01, 0.0105, 0.011]), [0.03, 0.03, 0.03])
    np.testing.assert_allclose(holm([0.9, 0.4, 0.5]), [1.0, 1.0, 1.0])
    np.testing.assert_allclose(holm([0.02, 0.001, 0.03, 0.9]), [0.06, 0.004, 0.06, 0.9])
    assert holm([]) == [] and holm([0.2]) == [0.2]


def test_a_means_interval_is_scipys_and_one_value_has_none() -> None:
    values = np.array([3.0, 1.0, 4.0, 1.5, 5.0])
    mean, low, high = mean_interval(values)
    theirs = ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert (mean, low, high) == pytest.approx((values.mean(), theirs.low, theirs.high))
    assert mean_interval([2.0, 4.0])[0] == 3.0 and mean_interval([2.0, 4.0])[1] < 0.0
    alone = mean_interval([7.0])
    assert alone[0] == 7.0 and np.isnan(alone[1:]).all()


def test_what_learning_hands_out_cannot_be_changed() -> None:
    assert changeable(wristctl.learning) == []
