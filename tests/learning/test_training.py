from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from wristctl.config.learning import DataSettings, NetworkSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning import training
from wristctl.learning.dataset import Samples, Split, draw_samples, split_samples
from wristctl.learning.evaluation import AngleErrors, angle_errors
from wristctl.learning.training import train_one
from wristctl.learning.training_processes import train_all
from wristctl.learning.training_result import Epoch, Job, TrainingResult, best_of

SEED = np.random.SeedSequence(7)


def trained_on(
    samples: Samples, split: Split, settings: NetworkSettings, seed: np.random.SeedSequence = SEED
) -> TrainingResult:
    return train_one(samples, Job("one", settings, split, seed))


def errors(trial: TrainingResult, samples: Samples, split: Split) -> AngleErrors:
    return angle_errors(trial.network.angle(samples.tip[split.test]), samples.theta[split.test])


def paper(**changes: object) -> AngleErrors:
    """The paper's network on the paper's number of samples."""
    samples = draw_samples(DataSettings(), WristParameters(), np.random.default_rng(0))
    split = split_samples(1000, 0.75, np.random.default_rng(0))
    return errors(trained_on(samples, split, NetworkSettings.model_validate(changes)), samples, split)


def same_bytes(a: TrainingResult, b: TrainingResult) -> bool:
    pairs = zip((*a.network.weights, *a.network.biases), (*b.network.weights, *b.network.biases), strict=True)
    return a.epochs == b.epochs and all(x.tobytes() == y.tobytes() for x, y in pairs)


@pytest.mark.slow
def test_standardised_adamw_learns_the_papers_network() -> None:
    learned = paper()
    assert learned.r2 > 0.998 and learned.rmse_deg < 1.2


@pytest.mark.slow
def test_t1s_sigmoid_as_printed_collapses_to_the_mean() -> None:
    collapsed = paper(preset="t1-sigmoid")
    assert abs(collapsed.r2) < 0.1, "C11: coupled weight decay of 0.01 leaves nothing but the mean"


def test_quick_network_learns(trained: TrainingResult, samples: Samples, split: Split) -> None:
    assert errors(trained, samples, split).r2 > 0.998


def test_losses_are_mean_squared_angles(
    trained: TrainingResult, samples: Samples, split: Split, quick: NetworkSettings
) -> None:
    error = trained.network.angle(samples.tip[split.validation]) - samples.theta[split.validation]
    assert trained.validation_loss == pytest.approx(float(np.mean(error**2)), rel=1e-9)
    assert [e.epoch for e in trained.epochs] == list(range(1, quick.epochs + 1))


@pytest.mark.parametrize("optimiser", ["adam", "adamw", "sgd", "levenberg-marquardt"])
def test_the_same_seed_gives_the_same_network(
    samples: Samples, split: Split, optimiser: str, quick: NetworkSettings
) -> None:
    settings = quick.model_copy(update={"optimiser": optimiser, "epochs": 2})
    first, second, other = (
        trained_on(samples, split, settings, seed) for seed in (SEED, SEED, np.random.SeedSequence(8))
    )
    assert same_bytes(first, second) and not same_bytes(first, other)


def test_gradient_norm_matches_finite_differences(samples: Samples, split: Split, quick: NetworkSettings) -> None:
    settings = quick.model_copy(update={"hidden": (3,), "epochs": 3})
    trial = trained_on(samples, split, settings)
    network = trial.network
    parameters = [*network.weights, *network.biases]

    def loss() -> float:
        error = (network.angle(samples.tip[split.train]) - samples.theta[split.train]) / network.output_scaler.deviation
        return float(np.mean(error**2))

    square = 0.0
    for array in parameters:
        for index in np.ndindex(array.shape):
            kept, step = array[index], 1e-6
            array[index] = kept + step
            above = loss()
            array[index] = kept - step
            square += ((above - loss()) / (2 * step)) ** 2
            array[index] = kept
    assert trial.gradient_norm == pytest.approx(np.sqrt(square), rel=1e-5)


def test_the_best_of_several_seeds_is_kept(samples: Samples, split: Split, quick: NetworkSettings) -> None:
    settings = quick.model_copy(update={"epochs": 2})
    trials = [trained_on(samples, split, settings, seed) for seed in np.random.SeedSequence(3).spawn(3)]
    assert best_of(trials).validation_loss == min(trial.epochs[-1].validation_loss for trial in trials)


@pytest.mark.slow
def test_the_number_of_processes_changes_no_byte(samples: Samples, split: Split, quick: NetworkSettings) -> None:
    settings = quick.model_copy(update={"epochs": 2})
    jobs = [Job(f"job-{k}", settings, split, seed, k) for k, seed in enumerate(np.random.SeedSequence(3).spawn(3))]
    told: set[tuple[int, int]] = set()
    over = train_all(samples, jobs, workers=2, report=lambda job, epoch: told.add((job, epoch.epoch)))
    for one, other in zip(train_all(samples, jobs, workers=1), over, strict=True):
        assert same_bytes(one, other)
    assert told == {(job, epoch) for job in range(3) for epoch in (1, 2)}


CHANGES: tuple[dict[str, object], ...] = (
    {},
    {"schedule": "cosine"},
    {"patience": 2, "learning_rate": 0.05},
    {"optimiser": "levenberg-marquardt", "weight_decay": 1e-5},
)


def interrupted_at(last: int, samples: Samples, job: Job, checkpoints: Path | None = None) -> TrainingResult:
    def stop(epoch: Epoch) -> None:
        if epoch.epoch == last:
            raise KeyboardInterrupt

    return train_one(samples, job, checkpoints=checkpoints, report=stop)


def test_interrupted_training_keeps_its_last_whole_epoch(
    samples: Samples, split: Split, quick: NetworkSettings
) -> None:
    trial = interrupted_at(3, samples, Job("one", quick, split, SEED))
    whole = trained_on(samples, split, quick.model_copy(update={"epochs": 3}))
    assert trial.interrupted and not whole.interrupted and same_bytes(trial, whole)


@pytest.mark.parametrize("change", CHANGES)
def test_a_training_taken_up_from_its_checkpoint_ends_in_the_same_bytes(
    samples: Samples,
    split: Split,
    quick: NetworkSettings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: dict[str, Any],
) -> None:
    monkeypatch.setattr(training, "SAVE_EVERY", 0.0)
    job = Job("one", quick.model_copy(update={"epochs": 6, **change}), split, SEED)
    interrupted_at(2, samples, job, tmp_path)
    again: list[int] = []
    resumed = train_one(samples, job, checkpoints=tmp_path, report=lambda epoch: again.append(epoch.epoch))
    assert again[0] == 3 and same_bytes(resumed, train_one(samples, job))


def test_another_trainings_or_a_broken_checkpoint_is_the_users_error(
    samples: Samples, split: Split, quick: NetworkSettings, tmp_path: Path
) -> None:
    job = Job("one", quick.model_copy(update={"epochs": 1}), split, SEED)
    train_one(samples, job, checkpoints=tmp_path)
    with pytest.raises(UserError, match="other settings, data or seed"):
        train_one(samples, replace(job, seed=np.random.SeedSequence(8)), checkpoints=tmp_path)
    file = tmp_path / "one.pt"
    file.write_bytes(file.read_bytes()[:500])
    with pytest.raises(UserError, match="not a readable checkpoint"):
        train_one(samples, job, checkpoints=tmp_path)


def test_patience_stops_early_and_keeps_the_best_epoch(samples: Samples, split: Split, quick: NetworkSettings) -> None:
    trial = trained_on(samples, split, quick.model_copy(update={"patience": 2, "learning_rate": 0.05, "epochs": 60}))
    losses = [epoch.validation_loss for epoch in trial.epochs]
    assert len(losses) < 60 and trial.validation_loss == min(losses) == losses[-3]


def test_diverged_training_is_the_users_error(samples: Samples, split: Split, quick: NetworkSettings) -> None:
    settings = quick.model_copy(update={"optimiser": "sgd", "learning_rate": 1e6, "activation": "relu"})
    with pytest.raises(UserError, match="learning_rate"):
        best_of([trained_on(samples, split, settings)])


def test_training_leaves_torchs_threads_and_random_state_alone(
    samples: Samples, split: Split, quick: NetworkSettings
) -> None:
    threads, state = torch.get_num_threads(), torch.get_rng_state()
    trained_on(samples, split, quick.model_copy(update={"epochs": 1}))
    assert torch.get_num_threads() == threads and torch.equal(torch.get_rng_state(), state)
