"""Three hidden layers count as best only where every fold says so of every other depth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ttest_rel

from wristctl.config.learning import NetworkSettings
from wristctl.learning.ranking import trained_alike
from wristctl.learning.selection import CrossValidated, Depth, compare_depths

FOLDS = np.array([1.00, 1.01, 0.99, 1.02, 0.98])


def judged(depth: int, rmse: np.ndarray, activation: str = "tanh", width: int = 8) -> CrossValidated:
    """A network of this depth with the errors of its folds."""
    settings = NetworkSettings.model_validate({"hidden": (width,) * depth, "activation": activation})
    return CrossValidated(settings, depth, width * depth, rmse)


def by_depth(*found: CrossValidated) -> dict[int, Depth]:
    (compared,) = compare_depths(found)
    return {each.best.depth: each for each in compared.depths}


def test_depths_that_every_fold_finds_worse_leave_three_as_best() -> None:
    wobble = np.array([0.010, -0.004, 0.006, 0.001, -0.008])
    found = [judged(1, 2.0 * FOLDS + wobble), judged(3, FOLDS), judged(5, 1.5 * FOLDS - wobble)]
    (compared,) = compare_depths(found)
    assert compared.three_is_best and [each.best.depth for each in compared.depths] == [1, 3, 5]
    assert [each.than_three for each in compared.depths] == ["worse", "", "worse"]
    raw = {each.depth: float(ttest_rel(each.rmse, FOLDS).pvalue) for each in (found[0], found[2])}
    low, high = sorted(raw, key=lambda depth: raw[depth])
    p = {each.best.depth: each.p for each in compared.depths}
    assert p[low] == pytest.approx(2.0 * raw[low]) and p[high] == pytest.approx(max(raw[high], 2.0 * raw[low]))
    assert np.isnan(p[3])


def test_a_difference_that_the_folds_do_not_support_is_none() -> None:
    found = by_depth(judged(2, FOLDS[::-1] + 0.01), judged(3, FOLDS))
    assert found[2].than_three == "no difference shown" and found[2].p > 0.05
    assert compare_depths([judged(2, FOLDS[::-1] + 0.01), judged(3, FOLDS)])[0].three_is_best is False


def test_a_better_depth_is_called_better_and_three_is_not_best() -> None:
    less = 0.5 * FOLDS + np.array([0.01, -0.01, 0.0, 0.01, -0.01])
    (compared,) = compare_depths([judged(3, FOLDS), judged(4, less), judged(1, 3.0 * FOLDS + less)])
    assert {each.best.depth: each.than_three for each in compared.depths} == {1: "worse", 3: "", 4: "better"}
    assert compared.three_is_best is False


def test_of_several_networks_of_a_depth_the_best_counts() -> None:
    found = by_depth(judged(3, FOLDS), judged(2, 4.0 * FOLDS, width=4), judged(2, 2.0 * FOLDS, width=16))
    assert found[2].best.multiply_adds == 32


def test_each_activation_is_judged_by_itself_and_without_three_layers_nothing_is_said() -> None:
    without, with_three = compare_depths([judged(1, FOLDS, "relu"), judged(3, FOLDS), judged(2, FOLDS, "relu")])
    assert (without.activation, with_three.activation) == ("relu", "tanh")
    assert without.three_is_best is None and with_three.three_is_best is True
    assert [each.than_three for each in without.depths] == ["", ""] and np.isnan([e.p for e in without.depths]).all()


def test_a_depth_that_diverged_in_a_fold_is_no_worse_by_proof() -> None:
    found = by_depth(judged(3, FOLDS), judged(4, np.array([1.0, np.inf, 1.0, 1.0, 1.0])))
    assert found[4].than_three == "no difference shown" and not found[4].p < 0.05


def test_only_networks_that_were_trained_the_same_way_are_ranked() -> None:
    printed, scaled = {"optimiser": "adam", "standardise": False}, {"optimiser": "adamw"}
    settings = {"a": printed, "b": scaled, "c": printed, "d": {"optimiser": "sgd"}, "e": scaled}
    networks = {name: NetworkSettings.model_validate(each) for name, each in settings.items()}
    assert trained_alike(networks) == {"adam-raw": ["a", "c"], "adamw-standardised": ["b", "e"]}
