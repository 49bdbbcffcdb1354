from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wristctl.config.learning import PRESETS, NetworkSettings, TrainSettings
from wristctl.errors import UserError
from wristctl.learning.dataset import split_samples
from wristctl.learning.ranking import holm, mean_interval, rank
from wristctl.learning.selection import CrossValidated, candidates, choose, fold_jobs, grid_points
from wristctl.learning.training_result import TrainingResult


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


def test_a_point_of_the_grid_has_its_own_values_and_the_sections_elsewhere() -> None:
    grid = {
        "depths": (1, 2),
        "activations": ("tanh", "relu"),
        "learning_rates": (0.1, 0.2),
        "weight_decays": (0.0, 0.5),
    }
    points = grid_points(TrainSettings.model_validate({"search": True, "epochs": 7, "grid": grid}))
    assert len({point.model_dump_json() for point in points}) == len(points) == 16
    assert {(p.activation, len(p.hidden), p.learning_rate, p.weight_decay) for p in points} == {
        (name, depth, rate, decay)
        for name in ("tanh", "relu") for depth in (1, 2) for rate in (0.1, 0.2) for decay in (0.0, 0.5)
    }  # fmt: skip
    assert {point.epochs for point in points} == {7}
    plain = grid_points(TrainSettings.model_validate({"search": True, "learning_rate": 0.3, "weight_decay": 0.2}))
    assert {(point.learning_rate, point.weight_decay) for point in plain} == {(0.3, 0.2)}


def test_every_point_meets_the_same_folds_and_each_fold_its_own_seed() -> None:
    split = split_samples(40, 0.75, np.random.default_rng(0))
    points = [NetworkSettings(hidden=(width,)) for width in (3, 5)]
    jobs = fold_jobs(points, split, 3, np.random.SeedSequence(1))
    assert [job.name for job in jobs] == [f"grid-{point}-{fold}" for point in (0, 1) for fold in (0, 1, 2)]
    assert [job.settings for job in jobs] == [points[0]] * 3 + [points[1]] * 3
    assert [job.trial for job in jobs] == [0, 1, 2, 0, 1, 2]
    for one, other in zip(jobs[:3], jobs[3:], strict=True):
        np.testing.assert_array_equal(one.split.validation, other.split.validation)
        np.testing.assert_array_equal(one.split.test, split.test)
        assert one.seed.generate_state(2).tolist() == other.seed.generate_state(2).tolist()
    assert len({job.seed.generate_state(1)[0] for job in jobs}) == 3
    sizes = [len(job.split.validation) for job in jobs[:3]]
    assert max(sizes) - min(sizes) <= 1


def test_two_samples_a_fold_are_the_fewest() -> None:
    split = split_samples(16, 0.75, np.random.default_rng(0))
    assert len(fold_jobs([NetworkSettings()], split, 7, np.random.SeedSequence(0))) == 7
    with pytest.raises(UserError, match="14 samples are too few for 8 folds"):
        fold_jobs([NetworkSettings()], split, 8, np.random.SeedSequence(0))


def test_folds_give_the_root_of_their_loss_and_a_diverged_one_is_infinite(trained: TrainingResult) -> None:
    losses = [0.04, 0.09, np.nan, 0.01]
    found = candidates([replace(trained, validation_loss=loss) for loss in losses], 2)
    np.testing.assert_allclose([each.rmse for each in found], [[0.2, 0.3], [np.inf, 0.1]])
    for each in found:
        assert each.settings == trained.job.settings and each.depth == 2
        assert each.multiply_adds == 2 * 24 + 24 * 16 + 16
    assert found[0].mean == pytest.approx(0.25) and found[0].standard_error == pytest.approx(0.05)


def test_the_reason_names_both_networks_with_their_errors_in_degrees() -> None:
    cheap = CrossValidated(NetworkSettings(hidden=(4, 3), activation="relu"), 2, 10, np.radians([1.1, 1.3]))
    best = CrossValidated(NetworkSettings(hidden=(9,), activation="tanh"), 1, 20, np.radians([0.9, 1.3]))
    assert choose([best, cheap]).reason == (
        "4-3 relu is the cheapest network (10 multiply-adds) whose cross-validated RMSE (1.2 deg) lies within one "
        "standard error (0.2 deg) of the least (1.1 deg, 9 tanh)"
    )
    twin = CrossValidated(NetworkSettings(hidden=(4, 3), activation="silu"), 2, 10, np.radians([1.0, 1.3]))
    assert choose([best, cheap, twin]).chosen is twin, "of the same cost the better one"


def test_a_fold_of_recordings_has_whole_ones() -> None:
    recording = np.repeat(np.arange(8), 10)
    split = split_samples(80, 0.75, np.random.default_rng(0), None, recording)
    jobs = fold_jobs([NetworkSettings()], split, 3, np.random.SeedSequence(0), recording)
    judged = [set(recording[job.split.validation].tolist()) for job in jobs]
    assert sum(map(len, judged)) == len(set().union(*judged)) == 7
    for job in jobs:
        assert not set(recording[job.split.train]) & set(recording[job.split.validation])
        assert not set(recording[job.split.train]) & set(recording[split.test])
    with pytest.raises(UserError, match="7 recordings are too few for 8 folds"):
        fold_jobs([NetworkSettings()], split, 8, np.random.SeedSequence(0), recording)
