"""Trainings beside plain torch: the same weights where the same is done with torch's own parts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from wristctl.config.learning import NetworkSettings
from wristctl.learning.dataset import Samples, Split
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Job, TrainingResult

SEED = np.random.SeedSequence(11)
PLAIN: dict[str, Any] = {"hidden": (5, 4), "activation": "silu", "epochs": 3, "batch": 64, "learning_rate": 0.02}


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """On several threads small layers wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


class Oracle:
    """One training by hand: standardised data, shuffled batches, a mean squared error."""

    def __init__(self, samples: Samples, split: Split, settings: NetworkSettings) -> None:
        self.settings = settings
        weight_seed, order_seed = (int(word) for word in SEED.generate_state(2))
        raw = samples.tip, samples.theta[:, None]
        if settings.standardise:
            self.scales = [(each[split.train].mean(axis=0), each[split.train].std(axis=0)) for each in raw]
        else:
            self.scales = [(np.zeros(each.shape[1]), np.ones(each.shape[1])) for each in raw]
        x, y = (torch.tensor((each - mean) / sd) for each, (mean, sd) in zip(raw, self.scales, strict=True))
        self.train, self.validation = (x[split.train], y[split.train]), (x[split.validation], y[split.validation])
        torch.manual_seed(weight_seed)
        layers: list[nn.Module] = []
        for inputs, neurons in pairwise((2, *settings.hidden)):
            layers += [nn.Linear(inputs, neurons, dtype=torch.float64), nn.SiLU()]
        self.model = nn.Sequential(*layers, nn.Linear(settings.hidden[-1], 1, dtype=torch.float64))
        self.order = torch.Generator().manual_seed(order_seed)
        self.square = float(self.scales[1][1][0] ** 2)

    def optimiser(self) -> torch.optim.Optimizer:
        s, weights = self.settings, self.model.parameters()
        if s.optimiser == "sgd":
            return torch.optim.SGD(weights, lr=s.learning_rate, momentum=s.beta1, weight_decay=s.weight_decay)
        kind: Any = {"adam": torch.optim.Adam, "adamw": torch.optim.AdamW}[s.optimiser]
        found: torch.optim.Optimizer = kind(
            weights, lr=s.learning_rate, betas=(s.beta1, 0.999), weight_decay=s.weight_decay
        )
        return found

    def run(self) -> list[tuple[float, float]]:
        """Train, and tell the losses of each epoch [rad^2]."""
        s, (x, y), losses = self.settings, self.train, []
        optimiser, steps = self.optimiser(), 0
        every = math.ceil(len(x) / s.batch)
        for _ in range(s.epochs):
            total = 0.0
            order = torch.randperm(len(x), generator=self.order)
            for rows in (order[at : at + s.batch] for at in range(0, len(x), s.batch)):
                if s.schedule == "cosine":
                    share = steps / (every * s.epochs)
                    for group in optimiser.param_groups:
                        group["lr"] = s.learning_rate * (1.0 + math.cos(math.pi * share)) / 2.0
                optimiser.zero_grad()
                loss = ((self.model(x[rows]) - y[rows]) ** 2).mean()
                loss.backward()
                optimiser.step()
                total += loss.item() * len(rows)
                steps += 1
            with torch.no_grad():
                error = float(((self.model(self.validation[0]) - self.validation[1]) ** 2).mean())
            losses.append((total / len(x) * self.square, error * self.square))
        return losses


@pytest.mark.parametrize(
    "change",
    [
        {"optimiser": "adamw", "weight_decay": 0.3},
        {"optimiser": "adam", "weight_decay": 0.3, "beta1": 0.5},
        {"optimiser": "sgd", "weight_decay": 0.1, "beta1": 0.8},
        {"optimiser": "adamw", "schedule": "cosine", "batch": 50},
        {"optimiser": "adamw", "standardise": False},
    ],
)
def test_a_training_is_torchs_own(samples: Samples, split: Split, change: dict[str, Any]) -> None:
    settings = NetworkSettings.model_validate(PLAIN | {"weight_decay": 0.0, "patience": 0} | change)
    done = train_one(samples, Job("one", settings, split, SEED))
    oracle = Oracle(samples, split, settings)
    losses = oracle.run()
    theirs = [each.detach().numpy() for each in oracle.model.parameters()]
    for ours, own in zip((each for pair in _layers(done) for each in pair), theirs, strict=True):
        np.testing.assert_allclose(ours, own, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose([(e.train_loss, e.validation_loss) for e in done.epochs], losses, rtol=1e-7)
    (mean, sd), (shift, scale) = oracle.scales
    np.testing.assert_allclose(done.network.input_scaler.mean, mean)
    np.testing.assert_allclose(done.network.input_scaler.deviation, sd)
    assert (done.network.output_scaler.mean, done.network.output_scaler.deviation) == (shift, scale)
    assert [epoch.trial for epoch in done.epochs] == [0, 0, 0]
    assert done.validation_loss == pytest.approx(losses[-1][1])


def _layers(done: TrainingResult) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(zip(done.network.weights, done.network.biases, strict=True))


def test_patience_counts_epochs_since_the_best_and_none_goes_on_to_the_end(samples: Samples, split: Split) -> None:
    for patience in (1, 3):
        settings = NetworkSettings.model_validate(PLAIN | {"patience": patience, "learning_rate": 0.3, "epochs": 80})
        losses = [e.validation_loss for e in train_one(samples, Job("one", settings, split, SEED)).epochs]
        assert len(losses) < 80
        best = [min(losses[: k + 1]) for k in range(len(losses))]
        stale = [k - losses.index(best[k]) for k in range(len(losses))]
        assert stale[-1] == patience and max(stale[:-1]) < patience
    whole = NetworkSettings.model_validate(PLAIN | {"patience": 0, "learning_rate": 0.3, "epochs": 20})
    done = train_one(samples, Job("one", whole, split, SEED))
    assert len(done.epochs) == 20 and done.validation_loss == done.epochs[-1].validation_loss


def test_a_job_of_a_later_trial_says_so_in_every_epoch(samples: Samples, split: Split) -> None:
    settings = NetworkSettings.model_validate(PLAIN | {"epochs": 2})
    done = train_one(samples, Job("one", settings, split, SEED, trial=4))
    assert [(epoch.trial, epoch.epoch) for epoch in done.epochs] == [(4, 1), (4, 2)]
