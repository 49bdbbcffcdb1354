"""Data sets and trainings as tables, the form in which runs keep them and figures draw them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pandas as pd

from wristctl.learning.dataset import Samples
from wristctl.wrist.kinematics import Array

if TYPE_CHECKING:
    from wristctl.learning.training import Epoch

UNITS = {
    "x": "m",
    "y": "m",
    "theta": "rad",
    "arc_length": "m",
    "theta_network": "rad",
    "theta_exact": "rad",
    "trial": "1",
    "epoch": "1",
    "train_loss": "rad^2",
    "validation_loss": "rad^2",
}
"""Units of the columns of all tables here."""

MEANING = {
    "x": "tip position along the straight wrist",
    "y": "tip position across it, toward positive bending",
    "theta": "bending angle",
    "arc_length": "length of the arc from the first to the last disc",
    "theta_network": "the network's angle",
    "theta_exact": "the exact inverse's angle, 2 atan2(y, x)",
    "trial": "which of the trainings with different initial weights",
    "epoch": "passes over the training data so far",
    "train_loss": "mean squared error of the angle over the epoch's batches, each before its own step",
    "validation_loss": "mean squared error of the angle on the validation samples, after the epoch",
}
"""What the columns of all tables here mean."""


def samples_table(samples: Samples) -> pd.DataFrame:
    """One row per sample: x, y, theta, arc_length."""
    x, y = samples.tip.T
    return pd.DataFrame({"x": x, "y": y, "theta": samples.theta, "arc_length": samples.arc_length})


def curves_table(epochs: Sequence[Epoch]) -> pd.DataFrame:
    """One row per trial and epoch: trial, epoch, train_loss, validation_loss."""
    return pd.DataFrame([vars(epoch) for epoch in epochs])


def predictions_table(tip: Array, theta: Array, theta_network: Array, theta_exact: Array) -> pd.DataFrame:
    """One row per tip: x, y, theta, theta_network, theta_exact."""
    x, y = tip.T
    columns = {"x": x, "y": y, "theta": theta, "theta_network": theta_network, "theta_exact": theta_exact}
    return pd.DataFrame(columns)
