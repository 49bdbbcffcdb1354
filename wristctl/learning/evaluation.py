"""Measures of every trained network and of the inverses it is compared with."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, Samples, Split
from wristctl.learning.domain import Domain
from wristctl.learning.inference import Polynomial, compiled_network
from wristctl.learning.training_result import TrainingResult
from wristctl.wrist.kinematics import arc_tip, exact_angle

# An error up to this counts as close.
CLOSE_DEG = 0.5


@dataclass(frozen=True)
class AngleErrors:
    """Errors of predicted bending angles over a set of samples."""

    r2: float
    """1 - sum of squared errors / sum of squared deviations from the mean"""
    rmse_deg: float
    """root of the mean squared error [deg]"""
    max_error_deg: float
    """largest absolute error [deg]"""
    close_share: float
    """share of samples with an absolute error of at most 0.5 deg"""


# Unit, better direction and meaning of each of AngleErrors' fields.
ANGLE_MEASURES: dict[str, tuple[str, Literal["lower", "higher"], str]] = {
    "r2": ("", "higher", "coefficient of determination of the angle"),
    "rmse_deg": ("deg", "lower", "root mean squared error of the angle"),
    "max_error_deg": ("deg", "lower", "largest absolute error of the angle"),
    "close_share": ("1", "higher", "share of samples with an error of at most 0.5 deg"),
}


@dataclass(frozen=True)
class ErrorMap:
    """Errors on a grid that fills a domain: A angles from end to end by L arc lengths."""

    tip: Array
    """(A, L, 2) [m]"""
    theta: Array
    """(A, L) true angle [rad]"""
    error: Array
    """(A, L) predicted minus true angle [rad]"""


def angle_errors(predicted: Array, true: Array) -> AngleErrors:
    """Measures of predicted against true angles of one shape [rad]; r2 is NaN where all true ones are equal."""
    error = predicted - true
    deviation = true - true.mean()
    with np.errstate(divide="ignore", invalid="ignore"):
        r2 = 1.0 - float(np.sum(error**2) / np.sum(deviation**2))
    degrees = np.abs(np.degrees(error))
    return AngleErrors(
        r2=r2,
        rmse_deg=float(np.sqrt(np.mean(degrees**2))),
        max_error_deg=float(degrees.max()),
        close_share=float(np.mean(degrees <= CLOSE_DEG)),
    )


def error_map(inverse: Callable[[Array], Array], domain: Domain, angles: int = 201, lengths: int = 41) -> ErrorMap:
    """Errors of `inverse`, tips (..., 2) [m] to angles (...) [rad], over the whole domain, edges included."""
    theta, length = np.meshgrid(
        np.linspace(*domain.theta, angles), np.linspace(*domain.arc_length, lengths), indexing="ij"
    )
    tip = arc_tip(theta, length)
    return ErrorMap(tip, theta, inverse(tip) - theta)


# Names of the places where samples were held out, by why.
HELD_OUT = {HELD_PAYLOAD: "held-out payloads", HELD_POSE: "held-out poses"}

# Unit and meaning of what `measures` gives.
MEASURES: dict[str, tuple[str, str]] = {
    **{name: (unit, f"{text}, on the test samples") for name, (unit, _, text) in ANGLE_MEASURES.items()},
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
    regions = [Place("test samples", samples.inputs[split.test], samples.theta[split.test])]
    for code, name in HELD_OUT.items():
        rows = split.test[held == code]
        if 0 < len(rows) < len(split.test):
            regions.append(Place(name, samples.inputs[rows], samples.theta[rows]))
    if samples.curvature_is_constant:
        grid = error_map(exact_angle, samples.domain)
        regions.append(Place("whole workspace", grid.tip, grid.theta))
    return regions


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
    errors = {
        place.name: angle_errors(
            angle(place.inputs.reshape(-1, place.inputs.shape[-1])[:, :columns]), place.theta.ravel()
        )
        for place in where
    }
    test, workspace = errors["test samples"], errors.get("whole workspace")
    held_out = {
        f"{name.replace(' ', '_').replace('-', '_')}_rmse_deg": errors[name].rmse_deg if name in errors else math.nan
        for name in HELD_OUT.values()
    }
    return {
        **vars(test),
        "workspace_rmse_deg": workspace.rmse_deg if workspace else math.nan,
        "workspace_max_error_deg": workspace.max_error_deg if workspace else math.nan,
        **held_out,
        "gradient_norm": trial.gradient_norm,
        "train_loss": trial.epochs[-1].train_loss,
        "validation_loss": trial.validation_loss,
        "validation_over_train": trial.validation_loss / trial.epochs[-1].train_loss,
        "epochs": float(len(trial.epochs)),
    }
