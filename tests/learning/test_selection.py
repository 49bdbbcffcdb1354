from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.errors import UserError
from wristctl.config.learning import PRESETS, NetworkSettings, TrainSettings
from wristctl.learning.dataset import split_samples
from wristctl.learning.ranking import holm, mean_interval, rank
from wristctl.learning.selection import CrossValidated, choose, fold_jobs, grid_points


def candidate(cost: int, rmse: list[float]) -> CrossValidated:
    return CrossValidated(NetworkSettings(), 3, cost, np.array(rmse))


def test_the_cheapest_network_within_one_standard_error_of_the_best_is_chosen() -> None:
    found = [candidate(10, [0.5, 0.6]), candidate(50, [0.11, 0.12]), candidate(90, [0.08, 0.14])]
    choice = choose(found)
    assert choice.best is found[2] and choice.chosen is found[1], "0.115 lies within 0.11 +- 0.03"
    assert "50 multiply-adds" in choice.reason


def test_a_diverged_network_is_never_chosen_and_a_grid_of_them_is_the_users_error() -> None:
    diverged = candidate(1, [np.inf, 0.01])
    assert choose([diverged, candidate(5, [0.2, 0.3])]).chosen.multiply_adds == 5
    with pytest.raises(UserError, match="diverged"):
        choose([diverged])


def test_the_papers_grid_has_five_depths_of_four_activations() -> None:
    points = grid_points(TrainSettings(search=True))
    assert len({(point.hidden, point.activation) for point in points}) == 20
    assert {point.hidden for point in points if len(point.hidden) == 3} == {(200, 100, 100)}


def test_folds_hold_out_every_sample_but_the_tests_once() -> None:
    split = split_samples(103, 0.75, np.random.default_rng(0))
    jobs = fold_jobs([NetworkSettings()], split, 5, np.random.SeedSequence(0))
    held = np.concatenate([job.split.validation for job in jobs])
    assert sorted(held) == sorted([*split.train, *split.validation])
    assert all(not set(job.split.train) & {*job.split.validation, *split.test} for job in jobs)


def test_holm_multiplies_by_the_number_of_tests_left() -> None:
    np.testing.assert_allclose(holm([0.04, 0.01, 0.03]), [0.06, 0.03, 0.06])


def test_a_clear_ranking_is_supported_and_noise_is_not() -> None:
    rng = np.random.default_rng(0)
    clear = rank({"a": 1.0 + 0.1 * rng.random(10), "b": 2.0 + 0.1 * rng.random(10), "c": 3.0 + rng.random(10)})
    noise = rank({name: rng.random(10) for name in "abc"})
    assert clear.order == ("a", "b", "c") and clear.supports_best("a") and not clear.supports_best("b")
    assert not any(noise.supports_best(name) for name in "abc")


def test_mean_interval_is_students() -> None:
    mean, low, high = mean_interval([1.0, 2.0, 3.0])
    assert mean == 2.0 and low < mean and high - mean == pytest.approx(4.302652729911275 / np.sqrt(3.0))


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_fills_what_is_not_given(name: str) -> None:
    plain = NetworkSettings.model_validate({"preset": name})
    changed = NetworkSettings.model_validate({"preset": name, "learning_rate": 0.5})
    assert all(getattr(plain, leaf) == value for leaf, value in PRESETS[name].items())
    assert changed == plain.model_copy(update={"learning_rate": 0.5})


def test_a_network_beyond_one_standard_error_is_not_chosen_however_cheap() -> None:
    """Least error 0.11 with a standard error of 0.03: 0.135 lies within, 0.145 beyond one and within two."""
    best = candidate(90, [0.08, 0.14])
    assert choose([candidate(10, [0.14, 0.15]), candidate(50, [0.13, 0.14]), best]).chosen.multiply_adds == 50
    assert choose([candidate(10, [0.14, 0.15]), best]).chosen is best
