"""How well predicted angles match the true ones: named measures in place of T1's undefined accuracy (C8)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.learning.domain import Domain
from wristctl.wrist.kinematics import arc_tip

CLOSE_DEG = 0.5
"""An error up to this counts as close."""


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


MEASURES: dict[str, tuple[str, Literal["lower", "higher"], str]] = {
    "r2": ("", "higher", "coefficient of determination of the angle"),
    "rmse_deg": ("deg", "lower", "root mean squared error of the angle"),
    "max_error_deg": ("deg", "lower", "largest absolute error of the angle"),
    "close_share": ("1", "higher", "share of samples with an error of at most 0.5 deg"),
}
"""Unit, better direction and meaning of each of AngleErrors' fields."""


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
