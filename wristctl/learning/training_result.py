"""Trainings: their jobs and their results."""

import math
from dataclasses import dataclass

import numpy as np

from wristctl.config.learning import NetworkSettings
from wristctl.errors import UserError
from wristctl.learning.dataset import Split
from wristctl.learning.network import Network


@dataclass(frozen=True)
class Job:
    """One training: of which network, on which samples, from which random start."""

    name: str
    """unique among trainings that run together; names the checkpoint"""
    settings: NetworkSettings
    split: Split
    seed: np.random.SeedSequence
    trial: int = 0
    """number of the training of its network, from 0"""


@dataclass(frozen=True)
class Epoch:
    """Losses of one pass over the training data: mean squared errors of the angle [rad^2]."""

    trial: int
    """number of the training, from 0"""
    epoch: int
    """from 1"""
    train_loss: float
    """mean over the epoch's steps, each before its own"""
    validation_loss: float
    """after the epoch"""


@dataclass(frozen=True)
class TrainingResult:
    """Result of one training."""

    job: Job
    network: Network
    """network of the last epoch; with patience, of the epoch with the least validation loss"""
    epochs: tuple[Epoch, ...]
    validation_loss: float
    """validation loss of the network [rad^2]; not finite where the training diverged"""
    gradient_norm: float
    """norm of the training loss's gradient (scaled angle, no weight decay) at these weights; nan if interrupted"""
    interrupted: bool
    """whether Ctrl-C ended it early; the network is then that of the last whole epoch"""


def best_of(trials: list[TrainingResult]) -> TrainingResult:
    """The trial with the least validation loss. Raises UserError where every one of them diverged."""
    finite = [trial for trial in trials if math.isfinite(trial.validation_loss)]
    if not finite:
        last = trials[-1]
        raise UserError(
            f"the training diverged in epoch {last.epochs[-1].epoch}",
            where="train.learning_rate",
            fix=f"choose less than {last.job.settings.learning_rate:g}, or set standardise: true",
        )
    return min(finite, key=lambda trial: trial.validation_loss)
