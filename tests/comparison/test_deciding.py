"""What decides a claim over the box: shares of variance in bins that are equally full, and thresholds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import f_oneway

from wristctl.comparison.robust import deciding, split


def explained(yes: np.ndarray, column: list[float] | list[str]) -> float:
    (leaf,) = deciding(yes.astype(bool), {"x": column})
    return leaf.share


def test_what_every_other_twelfth_of_a_number_decides_is_explained_whole() -> None:
    """Whatever its scale, and in any order; what every other thirteenth decides is not."""
    number = np.random.default_rng(0).permutation(1200)
    odd = number // 100 % 2 == 1
    for column in (number, -1.0 * number, 1e-3 * number**3):
        assert explained(odd, column.tolist()) == pytest.approx(1.0)
    assert explained(number // 92 % 2 == 1, number.tolist()) < 0.9


def test_infinity_is_a_bin_of_its_own_beside_the_twelve() -> None:
    number = np.arange(1200.0)
    odd = np.append(number // 100 % 2 == 1, np.ones(37, bool))
    assert explained(odd, [*number.tolist(), *[np.inf] * 37]) == pytest.approx(1.0)
    none = np.append(np.zeros(1200, bool), np.ones(37, bool))
    assert explained(none, [*number.tolist(), *[np.inf] * 37]) == pytest.approx(1.0)


def test_twelve_values_are_a_bin_each_and_so_are_any_number_of_words() -> None:
    values = np.arange(240)
    assert explained(values % 12 == 11, [float(each) ** 3 for each in values % 12]) == pytest.approx(1.0)
    assert explained(values % 40 == 39, [f"kind {each}" for each in values % 40]) == pytest.approx(1.0)
    assert explained(values % 40 == 39, (1.0 * (values % 40)).tolist()) < 0.5


@pytest.mark.parametrize("seed", range(4))
def test_the_share_is_omega_squared_of_an_analysis_of_variance(seed: int) -> None:
    """(k - 1) (F - 1) / ((k - 1) (F - 1) + N), and 0 where F is less than 1."""
    rng = np.random.default_rng(seed)
    kind = rng.integers(0, 4, 90)
    yes = rng.random(90) < 0.2 + 0.08 * seed * kind
    f = float(f_oneway(*(yes[kind == each].astype(float) for each in range(4))).statistic)
    wanted = 3.0 * (f - 1.0) / (3.0 * (f - 1.0) + 90.0)
    assert explained(yes, kind.tolist()) == pytest.approx(max(0.0, wanted))


def test_what_explains_most_comes_first_and_nothing_is_explained_by_one_value_or_one_each() -> None:
    yes = np.arange(60) < 30
    columns = {"same": [1.0] * 60, "half": (yes ^ (np.arange(60) % 4 == 0)).tolist(), "whole": yes.tolist()}
    leaves = deciding(yes, columns)
    assert [leaf.name for leaf in leaves] == ["whole", "half", "same"] and leaves[2].share == 0.0
    assert explained(yes[:20], [f"{number}" for number in range(20)]) == 0.0


def test_a_threshold_lies_between_two_values_halfway_in_their_logarithm_where_they_are_positive() -> None:
    yes = np.array([True] * 20 + [False] * 30)
    positive = np.append(np.linspace(1.0, 4.0, 20), np.linspace(9.0, 20.0, 30))
    mixed = positive - 10.0
    shuffled = np.random.default_rng(0).permutation(50)
    for x, at in ((positive, 6.0), (mixed, 0.5 * (mixed[19] + mixed[20])), (positive - 1.0, np.sqrt(3.0 * 8.0))):
        cut = split(yes[shuffled], x[shuffled].tolist())
        assert cut is not None and cut.at == pytest.approx(at) and (cut.below, cut.above) == (1.0, 0.0)
        assert cut.low <= cut.at <= cut.high


def test_a_threshold_never_parts_equal_values() -> None:
    x = np.repeat([1.0, 2.0, 3.0], 20)
    cut = split(np.arange(60) < 30, x.tolist())
    assert cut is not None and cut.at in (pytest.approx(np.sqrt(2.0)), pytest.approx(np.sqrt(6.0)))
    assert split(np.arange(60) < 30, [2.0] * 60) is None
    for all_alike in (np.ones(60, bool), np.zeros(60, bool)):
        assert split(all_alike, x.tolist()) is None
