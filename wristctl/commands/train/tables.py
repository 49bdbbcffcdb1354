"""Data sets and trainings as tables, the form in which runs keep them and figures draw them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.commands.gen_data.answer import SAMPLED
from wristctl.commands.quantities import Quantity, documented
from wristctl.learning.dataset import Samples
from wristctl.learning.network_file import TIP
from wristctl.simulation.trajectory import PLANES

if TYPE_CHECKING:
    from wristctl.learning.selection import CrossValidated
    from wristctl.learning.training_result import Epoch

_COLUMNS = [
    *SAMPLED.values(),
    Quantity("theta_network", "rad", "the network's angle"),
    Quantity("theta_exact", "rad", "the exact inverse's angle, 2 atan2(y, x)"),
    Quantity("theta_polynomial", "rad", "the angle of a polynomial of the inputs"),
    *(
        Quantity(f"bend_{plane}_{end}", "rad", f"the bend of {whose}, toward {plane}")
        for plane in PLANES
        for end, whose in (("network", "the network"), ("exact", "the exact inverse"), ("polynomial", "a polynomial"))
    ),
    Quantity("trial", "1", "which of the trainings with different initial weights"),
    Quantity("epoch", "1", "passes over the training data so far"),
    Quantity(
        "train_loss", "rad^2", "mean squared error of the angle over the epoch's batches, each before its own step"
    ),
    Quantity("validation_loss", "rad^2", "mean squared error of the angle on the validation samples, after the epoch"),
]
# Unit and meaning of the columns of all tables here, by name.
UNITS, MEANING = documented(_COLUMNS)

# Units of grid_table's columns.
GRID_UNITS = {"rmse_deg": "deg", "error_deg": "deg"}


def bends_by_plane(theta: Array, end: str = "") -> dict[str, Array]:
    """Bends (N,) as theta, (N, 2) as bend_ulnar and bend_flexion; `end` follows each name."""
    if theta.ndim == 1:
        return {f"theta{end}": theta}
    return {f"bend_{plane}{end}": column for plane, column in zip(PLANES, theta.T, strict=True)}


def samples_table(samples: Samples) -> pd.DataFrame:
    """One row per sample: the tip, other inputs, bend, arc_length; held_out where any is, recording if measured."""
    tip = dict(zip(TIP, samples.tip.T, strict=False))
    measured = dict(zip(samples.names, samples.others.T, strict=True))
    held = {"held_out": samples.held_out} if samples.held_out.any() else {}
    held |= {} if samples.recording is None else {"recording": samples.recording}
    return pd.DataFrame(tip | measured | bends_by_plane(samples.theta) | {"arc_length": samples.arc_length} | held)


def curves_table(epochs: Sequence[Epoch]) -> pd.DataFrame:
    """One row per trial and epoch: trial, epoch, train_loss, validation_loss."""
    return pd.DataFrame([vars(epoch) for epoch in epochs])


def predictions_table(
    inputs: Array, names: Sequence[str], theta: Array, theta_network: Array, theta_polynomial: Array, theta_exact: Array
) -> pd.DataFrame:
    """One row per sample: the tip, the inputs `names` after it, the bend, and that of the three inverses."""
    tip = TIP[: inputs.shape[1] - len(names)]
    inputs_of = dict(zip((*tip, *names), inputs.T, strict=True))
    ends = {"": theta, "_network": theta_network, "_polynomial": theta_polynomial, "_exact": theta_exact}
    bends = {name: column for end, bend in ends.items() for name, column in bends_by_plane(bend, end).items()}
    return pd.DataFrame(inputs_of | bends)


def grid_table(results: Sequence[CrossValidated]) -> pd.DataFrame:
    """One row per point of the grid: its settings, cost, and cross-validated RMSE with its standard error."""
    return pd.DataFrame(
        [
            {
                "hidden": "-".join(map(str, result.settings.hidden)),
                "depth": result.depth,
                "activation": result.settings.activation,
                "learning_rate": result.settings.learning_rate,
                "weight_decay": result.settings.weight_decay,
                "multiply_adds": result.multiply_adds,
                "rmse_deg": np.degrees(result.mean),
                "error_deg": np.degrees(result.standard_error),
            }
            | {f"fold_{fold}_rmse_deg": np.degrees(value) for fold, value in enumerate(result.rmse)}
            for result in results
        ]
    )
