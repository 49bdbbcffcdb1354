"""Measures of every trained network and of the inverses it is compared with."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, Samples, Split
from wristctl.learning.domain import Domain, arc_to
from wristctl.learning.inference import Polynomial, compiled_network
from wristctl.learning.training_result import TrainingResult
from wristctl.wrist.kinematics import arc_tip
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

# An error up to this counts as close.
CLOSE_DEG = 0.5


@dataclass(frozen=True)
class AngleErrors:
    """Errors of predicted bends over a set of samples; in two planes an error is the norm over both."""

    r2: float
    """1 - sum of squared errors / sum of squared deviations from the mean"""
    rmse_deg: float
    """root of the mean squared error [deg]"""
    max_error_deg: float
    """largest absolute error [deg]"""
    close_share: float
    """share of samples with an absolute error of at most 0.5 deg"""
    rmse_ulnar_deg: float = math.nan
    """in two planes the root of the mean squared error of the bend toward ulnar [deg]"""
    rmse_flexion_deg: float = math.nan
    """the same toward flexion"""

    def known(self) -> dict[str, float]:
        """The measures that these planes have, by name."""
        of_a_plane = ("rmse_ulnar_deg", "rmse_flexion_deg")
        return {name: value for name, value in vars(self).items() if name not in of_a_plane or not math.isnan(value)}


# Unit, better direction and meaning of each of AngleErrors' fields.
ANGLE_MEASURES: dict[str, tuple[str, Literal["lower", "higher"], str]] = {
    "r2": ("", "higher", "coefficient of determination of the angle"),
    "rmse_deg": ("deg", "lower", "root mean squared error of the angle"),
    "max_error_deg": ("deg", "lower", "largest absolute error of the angle"),
    "close_share": ("1", "higher", "share of samples with an error of at most 0.5 deg"),
    "rmse_ulnar_deg": ("deg", "lower", "root mean squared error of the bend toward ulnar"),
    "rmse_flexion_deg": ("deg", "lower", "root mean squared error of the bend toward flexion"),
}


@dataclass(frozen=True)
class ErrorMap:
    """Errors on a grid that fills a domain: A angles from end to end by L arc lengths.

    In two planes A sizes of the bend by D directions by L arc lengths; bends have a last axis of both planes.
    """

    tip: Array
    """(A, L, 2), in two planes (A, D, L, 3) [m]"""
    theta: Array
    """(A, L) or (A, D, L, 2) true bend [rad]"""
    error: Array
    """(A, L) or (A, D, L, 2) predicted minus true bend [rad]"""

    @property
    def size(self) -> Array:
        """Absolute errors (A, L), in two planes norms (A, D, L) [rad]."""
        return size_of(self.error, self.tip.shape[-1] - 1)


def size_of(error: Array, planes: int) -> Array:
    """Sizes of errors (...), in two planes of shape (..., 2)."""
    return np.abs(error) if planes == 1 else np.hypot(error[..., 0], error[..., 1])


def angle_errors(predicted: Array, true: Array, planes: int = 1) -> AngleErrors:
    """Measures of predicted against true bends of one shape [rad]; r2 is NaN where all true ones are equal.

    In two planes the last axis is that of the planes.
    """
    error = predicted - true
    deviation = true - (true.mean() if planes == 1 else true.reshape(-1, planes).mean(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        r2 = 1.0 - float(np.sum(error**2) / np.sum(deviation**2))
    degrees = size_of(np.degrees(error), planes)
    of_planes = np.sqrt(np.mean(np.degrees(error).reshape(-1, planes) ** 2, axis=0)).tolist() if planes == 2 else []
    return AngleErrors(
        r2,
        float(np.sqrt(np.mean(degrees**2))),
        float(degrees.max()),
        float(np.mean(degrees <= CLOSE_DEG)),
        *of_planes,
    )


# Sizes of bends, directions and arc lengths of a map in two planes.
_SIZES, _TOWARD, _LENGTHS = 41, 72, 21


def error_map(inverse: Callable[[Array], Array], domain: Domain, angles: int = 201, lengths: int = 41) -> ErrorMap:
    """Errors of `inverse`, tips (..., P + 1) [m] to bends [rad], over the whole domain, edges included.

    In two planes the map has its own numbers of sizes, directions and arc lengths.
    """
    if domain.planes == 2:
        sizes, around = np.linspace(*domain.theta, _SIZES), np.linspace(0.0, 2.0 * np.pi, _TOWARD + 1)
        of_sizes = sizes[:, None, None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
        bends = np.repeat(of_sizes[:, :, None], _LENGTHS, axis=2)
        tip = np.linspace(*domain.arc_length, _LENGTHS)[:, None] * spatial_tips(bends, 1.0)
        return ErrorMap(tip, bends, inverse(tip) - bends)
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
    """Inputs with known bends, on which inverses are judged."""

    name: str
    inputs: Array
    """(..., D), the tip first"""
    theta: Array
    """(...), in two planes (..., 2) [rad]"""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return 1 if self.theta.ndim < self.inputs.ndim else self.theta.shape[-1]

    @property
    def count(self) -> int:
        """Number of bends."""
        return self.theta.size // self.planes

    def errors(self, predicted: Array) -> AngleErrors:
        """Errors of bends that an inverse gives for the inputs."""
        return angle_errors(predicted.reshape(self.theta.shape), self.theta, self.planes)


def places(samples: Samples, split: Split) -> list[Place]:
    """The test samples, by reason where they were held out, and the whole domain where its angles are known."""
    held = samples.held_out[split.test]
    regions = [Place("test samples", samples.inputs[split.test], samples.theta[split.test])]
    for code, name in HELD_OUT.items():
        rows = split.test[held == code]
        if 0 < len(rows) < len(split.test):
            regions.append(Place(name, samples.inputs[rows], samples.theta[rows]))
    if samples.curvature_is_constant:
        grid = error_map(exact_bends, samples.domain)
        regions.append(Place("whole workspace", grid.tip, grid.theta))
    return regions


def inverses(
    trial: TrainingResult, samples: Samples, split: Split
) -> dict[str, tuple[Callable[[Array], Array], int, int]]:
    """The network, a polynomial of all inputs and the exact inverse: bends of inputs, parameters, multiply-adds."""
    network = trial.network
    columns, tip = network.sizes[0], samples.planes + 1
    polynomial = Polynomial.fit(samples.inputs[split.train], samples.theta[split.train])
    return {
        "network": (lambda x: network.angle(x[..., :columns]), network.parameters, network.multiply_adds),
        "polynomial": (polynomial.angle, polynomial.factors.size, polynomial.multiply_adds),
        "exact inverse": (lambda x: exact_bends(x[..., :tip]), 0, 0),
    }


def exact_bends(tip: Array) -> Array:
    """Bends [rad] of the arc to each tip (..., P + 1) [m]: (...), in two planes (..., 2)."""
    return arc_to(tip)[0]


def measures(trial: TrainingResult, where: Sequence[Place]) -> dict[str, float]:
    """Every one of MEASURES, NaN for places that these data do not have."""
    columns, angle = trial.network.sizes[0], compiled_network(trial.network)
    errors = {
        place.name: place.errors(angle(place.inputs.reshape(-1, place.inputs.shape[-1])[:, :columns]))
        for place in where
    }
    test, workspace = errors["test samples"], errors.get("whole workspace")
    held_out = {
        f"{name.replace(' ', '_').replace('-', '_')}_rmse_deg": errors[name].rmse_deg if name in errors else math.nan
        for name in HELD_OUT.values()
    }
    return {
        **test.known(),
        "workspace_rmse_deg": workspace.rmse_deg if workspace else math.nan,
        "workspace_max_error_deg": workspace.max_error_deg if workspace else math.nan,
        **held_out,
        "gradient_norm": trial.gradient_norm,
        "train_loss": trial.epochs[-1].train_loss,
        "validation_loss": trial.validation_loss,
        "validation_over_train": trial.validation_loss / trial.epochs[-1].train_loss,
        "epochs": float(len(trial.epochs)),
    }
