from __future__ import annotations

import numpy as np
import pytest
import torch

from wristctl.config.errors import UserError
from wristctl.config.learning import DataSettings, TrainSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.dataset import Samples, Split, draw_samples, split_samples
from wristctl.learning.metrics import AngleErrors, angle_errors
from wristctl.learning.training import Epoch, Training, train

SEED = np.random.SeedSequence(7)


def errors(training: Training, samples: Samples, split: Split) -> AngleErrors:
    return angle_errors(training.network.angle(samples.tip[split.test]), samples.theta[split.test])


def paper(**changes: object) -> AngleErrors:
    """The paper's network on the paper's number of samples."""
    samples = draw_samples(DataSettings(), WristParameters(), np.random.default_rng(0))
    split = split_samples(1000, 0.75, np.random.default_rng(0))
    settings = TrainSettings.model_validate(changes)
    return errors(train(samples, split, settings, [SEED]), samples, split)


def test_standardised_adamw_learns_the_papers_network() -> None:
    learned = paper()
    assert learned.r2 > 0.998 and learned.rmse_deg < 1.2


def test_printed_adam_on_raw_inputs_collapses_to_the_mean() -> None:
    collapsed = paper(optimiser="adam", standardise=False)
    assert abs(collapsed.r2) < 0.1, "C11: coupled weight decay of 0.01 leaves nothing but the mean"


def test_quick_network_learns(trained: Training, samples: Samples, split: Split) -> None:
    assert errors(trained, samples, split).r2 > 0.998


def test_losses_are_mean_squared_angles(
    trained: Training, samples: Samples, split: Split, quick: TrainSettings
) -> None:
    error = trained.network.angle(samples.tip[split.validation]) - samples.theta[split.validation]
    assert trained.epochs[-1].validation_loss == pytest.approx(float(np.mean(error**2)), rel=1e-9)
    assert [e.epoch for e in trained.epochs] == list(range(1, quick.epochs + 1))


@pytest.mark.parametrize("optimiser", ["adam", "adamw", "sgd"])
def test_the_same_seed_gives_the_same_network(
    samples: Samples, split: Split, optimiser: str, quick: TrainSettings
) -> None:
    settings = quick.model_copy(update={"optimiser": optimiser, "epochs": 2})
    first, second, other = (
        train(samples, split, settings, [seed]).network.weights for seed in (SEED, SEED, np.random.SeedSequence(8))
    )
    assert all(a.tobytes() == b.tobytes() for a, b in zip(first, second, strict=True))
    assert first[0].tobytes() != other[0].tobytes()


def test_gradient_norm_matches_finite_differences(samples: Samples, split: Split, quick: TrainSettings) -> None:
    settings = quick.model_copy(update={"hidden": (3,), "epochs": 3})
    training = train(samples, split, settings, [SEED])
    network = training.network
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
    assert training.gradient_norm == pytest.approx(np.sqrt(square), rel=1e-5)


def test_the_best_of_several_seeds_is_kept(samples: Samples, split: Split, quick: TrainSettings) -> None:
    seeds = np.random.SeedSequence(3).spawn(3)
    training = train(samples, split, quick.model_copy(update={"epochs": 4}), seeds)
    final = [e.validation_loss for e in training.epochs if e.epoch == 4]
    assert len(final) == 3 and training.trial == int(np.argmin(final))


def test_a_trial_does_not_depend_on_the_trials_before_it(samples: Samples, split: Split, quick: TrainSettings) -> None:
    first, second = np.random.SeedSequence(3).spawn(2)
    settings = quick.model_copy(update={"epochs": 2})
    both = train(samples, split, settings, [first, second]).epochs[2:]
    alone = train(samples, split, settings, [second]).epochs
    assert [e.validation_loss for e in both] == [e.validation_loss for e in alone]


def test_interrupted_training_keeps_its_last_whole_epoch(samples: Samples, split: Split, quick: TrainSettings) -> None:
    def stop(epoch: Epoch) -> None:
        if epoch.epoch == 3:
            raise KeyboardInterrupt

    training = train(samples, split, quick, [SEED], stop)
    whole = train(samples, split, quick.model_copy(update={"epochs": 3}), [SEED])
    assert training.interrupted and not whole.interrupted
    assert len(training.epochs) == 3
    assert training.network.weights[0].tobytes() == whole.network.weights[0].tobytes()


def test_diverged_training_is_the_users_error(samples: Samples, split: Split, quick: TrainSettings) -> None:
    settings = quick.model_copy(update={"optimiser": "sgd", "learning_rate": 1e6, "activation": "relu"})
    with pytest.raises(UserError, match="learning_rate"):
        train(samples, split, settings, [SEED])


def test_training_leaves_torchs_threads_and_random_state_alone(
    samples: Samples, split: Split, quick: TrainSettings
) -> None:
    threads, state = torch.get_num_threads(), torch.get_rng_state()
    train(samples, split, quick.model_copy(update={"epochs": 1}), [SEED])
    assert torch.get_num_threads() == threads and torch.equal(torch.get_rng_state(), state)
