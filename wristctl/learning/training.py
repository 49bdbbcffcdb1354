"""Training a network with torch: on one thread and seeded, so that the same settings give the same bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from wristctl.config.errors import UserError
from wristctl.config.learning import Activation, TrainSettings
from wristctl.learning.dataset import Samples, Split
from wristctl.learning.network import LEAK, Network, Scaler

DTYPE = torch.float64
"""Doubles take a third longer than singles, and let the frozen network equal the trained one to rounding."""

BLOCK = 8192
"""Samples evaluated at once where no gradient step is taken."""

LAYERS: dict[Activation, Callable[[], nn.Module]] = {
    "sigmoid": nn.Sigmoid,
    "relu": nn.ReLU,
    "leaky-relu": lambda: nn.LeakyReLU(LEAK),
    "tanh": nn.Tanh,
    "silu": nn.SiLU,
}


@dataclass(frozen=True)
class Epoch:
    """Losses of one pass over the training data: mean squared errors of the angle [rad^2]."""

    trial: int
    """which of the trainings, from 0"""
    epoch: int
    """from 1"""
    train_loss: float
    """mean over the epoch's batches, each before its own step"""
    validation_loss: float
    """after the epoch"""


@dataclass(frozen=True)
class Training:
    """What came of it: the kept network and the curves of every trial."""

    network: Network
    trial: int
    """the kept trial: the one with the least validation loss after its last epoch"""
    epochs: tuple[Epoch, ...]
    gradient_norm: float
    """norm of the training loss's gradient at the kept weights: of the scaled angle, without weight decay"""
    interrupted: bool
    """whether Ctrl-C ended it early; the network is then the best after whole epochs"""


@dataclass
class _Candidate:
    trial: int
    validation_loss: float
    state: dict[str, Tensor]


def train(
    samples: Samples,
    split: Split,
    settings: TrainSettings,
    seeds: list[np.random.SeedSequence],
    progress: Callable[[Epoch], None] = lambda epoch: None,
) -> Training:
    """Train one network per seed, one after another, keeping the best; `progress` is called after each epoch.

    Raises UserError where every trial diverges, KeyboardInterrupt only before the first epoch's end.
    """
    problem = _Problem(samples, split, settings)
    epochs: list[Epoch] = []
    candidates: list[_Candidate] = []
    interrupted = False
    with _one_thread():
        try:
            for trial, seed in enumerate(seeds):
                for epoch, candidate in _trial(problem, trial, seed):
                    epochs.append(epoch)
                    candidates[trial:] = [candidate]
                    progress(epoch)
        except KeyboardInterrupt:
            if not candidates:
                raise
            interrupted = True
        finite = [c for c in candidates if math.isfinite(c.validation_loss)]
        if not finite:
            raise UserError(
                f"the training diverged in epoch {epochs[-1].epoch}",
                where="train.learning_rate",
                fix=f"choose less than {settings.learning_rate:g}, or set standardise: true",
            )
        best = min(finite, key=lambda c: c.validation_loss)
        model = problem.model(0)
        model.load_state_dict(best.state)
        return Training(problem.export(model), best.trial, tuple(epochs), problem.gradient_norm(model), interrupted)


class _Problem:
    """The data as scaled tensors, and what is asked of a model on them."""

    def __init__(self, samples: Samples, split: Split, settings: TrainSettings) -> None:
        self.settings, self.domain = settings, samples.domain
        theta = samples.theta[:, None]
        fit = Scaler.of if settings.standardise else lambda values: Scaler.none(values.shape[1])
        self.input, self.output = fit(samples.tip[split.train]), fit(theta[split.train])

        def tensors(rows: NDArray[np.int64]) -> tuple[Tensor, Tensor]:
            scaled = self.input.scale(samples.tip[rows]), self.output.scale(theta[rows])
            return torch.tensor(scaled[0], dtype=DTYPE), torch.tensor(scaled[1], dtype=DTYPE)

        self.train, self.validation = tensors(split.train), tensors(split.validation)
        self.square_radians = float(self.output.deviation[0] ** 2)

    def model(self, seed: int) -> nn.Sequential:
        """A perceptron with torch's usual random weights."""
        layers: list[nn.Module] = []
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            for inputs, neurons in pairwise((2, *self.settings.hidden)):
                layers += [nn.Linear(inputs, neurons, dtype=DTYPE), LAYERS[self.settings.activation]()]
            return nn.Sequential(*layers, nn.Linear(self.settings.hidden[-1], 1, dtype=DTYPE))

    def optimiser(self, model: nn.Sequential) -> torch.optim.Optimizer:
        rate, beta1, decay = self.settings.learning_rate, self.settings.beta1, self.settings.weight_decay
        if self.settings.optimiser == "sgd":
            return torch.optim.SGD(model.parameters(), lr=rate, momentum=beta1, weight_decay=decay)
        kind = torch.optim.AdamW if self.settings.optimiser == "adamw" else torch.optim.Adam
        return kind(model.parameters(), lr=rate, betas=(beta1, 0.999), weight_decay=decay)

    def validation_loss(self, model: nn.Sequential) -> float:
        with torch.no_grad():
            squares = sum(float(((model(x) - y) ** 2).sum()) for x, y in _blocks(*self.validation))
        return squares / len(self.validation[0]) * self.square_radians

    def gradient_norm(self, model: nn.Sequential) -> float:
        model.zero_grad()
        for x, y in _blocks(*self.train):
            loss: Tensor = ((model(x) - y) ** 2).sum() / len(self.train[0])
            loss.backward()  # type: ignore[no-untyped-call]
        return math.sqrt(sum(float((p.grad**2).sum()) for p in model.parameters() if p.grad is not None))

    def export(self, model: nn.Sequential) -> Network:
        linear = [layer for layer in model if isinstance(layer, nn.Linear)]
        return Network(
            tuple(layer.weight.detach().numpy().astype(np.float64) for layer in linear),
            tuple(layer.bias.detach().numpy().astype(np.float64) for layer in linear),
            self.settings.activation,
            self.input,
            self.output,
            self.domain,
        )


def _trial(problem: _Problem, trial: int, seed: np.random.SeedSequence) -> Iterator[tuple[Epoch, _Candidate]]:
    """One training; after each epoch its losses and a copy of the weights. Ends early where it diverges."""
    weight_seed, order_seed = (int(word) for word in seed.generate_state(2))
    model = problem.model(weight_seed)
    optimiser = problem.optimiser(model)
    shuffle = torch.Generator().manual_seed(order_seed)
    x, y = problem.train
    for epoch in range(1, problem.settings.epochs + 1):
        squares = 0.0
        order = torch.randperm(len(x), generator=shuffle)
        for start in range(0, len(x), problem.settings.batch):
            rows = order[start : start + problem.settings.batch]
            optimiser.zero_grad()
            loss = nn.functional.mse_loss(model(x[rows]), y[rows])
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            squares += loss.item() * len(rows)
        validation = problem.validation_loss(model)
        result = Epoch(trial, epoch, squares / len(x) * problem.square_radians, validation)
        yield result, _Candidate(trial, validation, {k: v.clone() for k, v in model.state_dict().items()})
        if not math.isfinite(validation):
            return


def _blocks(x: Tensor, y: Tensor) -> Iterator[tuple[Tensor, Tensor]]:
    for start in range(0, len(x), BLOCK):
        yield x[start : start + BLOCK], y[start : start + BLOCK]


@contextmanager
def _one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
