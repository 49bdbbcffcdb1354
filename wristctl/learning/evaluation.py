"""What is said of every trained network, and of what stands beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from wristctl.arrays import Array
from wristctl.learning.angle_errors import MEASURES as OF_ANGLES
from wristctl.learning.angle_errors import angle_errors, error_map
from wristctl.learning.baseline import Polynomial
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, Samples, Split
from wristctl.learning.inference import compiled_network
from wristctl.learning.training_result import TrainingResult
from wristctl.wrist.kinematics import exact_angle

HELD_OUT = {HELD_PAYLOAD: "held-out payloads", HELD_POSE: "held-out poses"}
"""Names of the places where samples were held out, by why."""

MEASURES: dict[str, tuple[str, str]] = {
    **{name: (unit, f"{text}, on the test samples") for name, (unit, _, text) in OF_ANGLES.items()},
    "workspace_rmse_deg": ("deg", "RMSE on a dense grid over the whole domain"),
    "workspace_max_error_deg": ("deg", "largest error on a dense grid over the whole domain"),
    "held_out_payloads_rmse_deg": ("deg", "RMSE of the angle at payloads kept from training"),
    "held_out_poses_rmse_deg": ("deg", "RMSE of the angle at poses kept from training"),
    "gradient_norm": ("", "norm of the training loss's gradient at the kept weights (of the scaled angle)"),
    "train_loss": ("rad^2", "mean squared error over the last epoch's batches"),
    "validation_loss": ("rad^2", "mean squared error on the validation samples"),
    "validation_over_train": ("1", "validation loss over training loss"),
    "epochs": ("1", "epochs done"),
}
"""Unit and meaning of what `measures` gives."""


@dataclass(frozen=True)
class Place:
    """Inputs with known angles, on which inverses are judged."""

    name: str
    inputs: Array
    """(..., D), x and y first"""
    theta: Array
    """(...) [rad]"""


def places(samples: Samples, split: Split) -> list[Place]:
    """The test samples, by reason where they were held out, and the whole domain where its angles are known."""
    held = samples.held_out[split.test]
    found = [Place("test samples", samples.inputs[split.test], samples.theta[split.test])]
    for code, name in HELD_OUT.items():
        rows = split.test[held == code]
        if 0 < len(rows) < len(split.test):
            found.append(Place(name, samples.inputs[rows], samples.theta[rows]))
    if samples.curvature_is_constant:
        grid = error_map(exact_angle, samples.domain)
        found.append(Place("whole workspace", grid.tip, grid.theta))
    return found


def inverses(
    trial: TrainingResult, samples: Samples, split: Split
) -> dict[str, tuple[Callable[[Array], Array], int, int]]:
    """The network, a polynomial of all inputs and the exact inverse: angles of inputs, parameters, multiply-adds."""
    network = trial.network
    columns = network.sizes[0]
    polynomial = Polynomial.fit(samples.inputs[split.train], samples.theta[split.train])
    return {
        "network": (lambda x: network.angle(x[..., :columns]), network.parameters, network.multiply_adds),
        "polynomial": (polynomial.angle, len(polynomial.factors), polynomial.multiply_adds),
        "exact inverse": (lambda x: exact_angle(x[..., :2]), 0, 0),
    }


def measures(trial: TrainingResult, where: Sequence[Place]) -> dict[str, float]:
    """Every one of MEASURES, NaN for places that these data do not have."""
    columns, angle = trial.network.sizes[0], compiled_network(trial.network)
    found = {
        place.name: angle_errors(
            angle(place.inputs.reshape(-1, place.inputs.shape[-1])[:, :columns]), place.theta.ravel()
        )
        for place in where
    }
    test, whole = found["test samples"], found.get("whole workspace")
    held_out = {
        f"{name.replace(' ', '_').replace('-', '_')}_rmse_deg": found[name].rmse_deg if name in found else math.nan
        for name in HELD_OUT.values()
    }
    return {
        **vars(test),
        "workspace_rmse_deg": whole.rmse_deg if whole else math.nan,
        "workspace_max_error_deg": whole.max_error_deg if whole else math.nan,
        **held_out,
        "gradient_norm": trial.gradient_norm,
        "train_loss": trial.epochs[-1].train_loss,
        "validation_loss": trial.validation_loss,
        "validation_over_train": trial.validation_loss / trial.epochs[-1].train_loss,
        "epochs": float(len(trial.epochs)),
    }
