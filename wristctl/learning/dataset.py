"""Samples of tip positions and bending angles from the constant-curvature model (E1)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.config.errors import UserError
from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.domain import Domain
from wristctl.wrist.kinematics import Array, arc_tip

LEAST_SHARE = 2
"""Samples that validation and test need at least: one sample has no spread to explain."""


@dataclass(frozen=True)
class Samples:
    """N arcs and the region they were drawn from."""

    tip: Array
    """(N, 2) x and y of the last disc's centre [m]"""
    theta: Array
    """(N,) bending angle [rad]"""
    arc_length: Array
    """(N,) [m]"""
    domain: Domain

    def arrays(self) -> dict[str, Array]:
        """The samples as named arrays; `from_arrays` reads them back without loss."""
        ends = np.array([self.domain.theta, self.domain.arc_length])
        return {"tip": self.tip, "theta": self.theta, "arc_length": self.arc_length, "domain": ends}

    @staticmethod
    def from_arrays(arrays: dict[str, Array]) -> Samples:
        """Samples from what `arrays` gave. Raises KeyError where an array is missing."""
        theta, arc_length = arrays["domain"].tolist()
        domain = Domain(tuple(theta), tuple(arc_length))
        return Samples(arrays["tip"], arrays["theta"], arrays["arc_length"], domain)


@dataclass(frozen=True)
class Split:
    """Row numbers of the samples used for training, validation and test; disjoint and complete."""

    train: NDArray[np.int64]
    validation: NDArray[np.int64]
    test: NDArray[np.int64]


def draw_samples(settings: DataSettings, wrist: WristParameters, rng: np.random.Generator) -> Samples:
    """Samples with the angle in +-range_deg and the arc length in stretch * length, both spread evenly."""
    bend = math.radians(wrist.range_deg)
    low, high = (ratio * wrist.length for ratio in settings.stretch)
    unit = _unit_square(settings.sampling, settings.samples, rng)
    theta = -bend + 2.0 * bend * unit[:, 0]
    length = low + (high - low) * unit[:, 1]
    return Samples(arc_tip(theta, length), theta, length, Domain((-bend, bend), (low, high)))


def split_samples(count: int, train_share: float, rng: np.random.Generator) -> Split:
    """A random split: `train_share` for training, the rest halved into validation and test.

    Raises UserError where fewer than two samples would be left for either.
    """
    train = max(1, round(count * train_share))
    validation = (count - train) // 2
    if validation < LEAST_SHARE:
        raise UserError(
            f"{count} samples with train_share {train_share:g} leave {validation} for validation",
            where="train.train_share",
            fix=f"draw more samples or lower the share: validation and test need {LEAST_SHARE} each",
        )
    order = rng.permutation(count)
    return Split(order[:train], order[train : train + validation], order[train + validation :])


def _unit_square(sampling: str, count: int, rng: np.random.Generator) -> Array:
    """`count` points (count, 2) in the unit square."""
    if sampling == "uniform":
        return rng.random((count, 2))
    from scipy.stats import qmc

    if sampling == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(d=2, rng=rng).random(count))
    # A Sobol sequence is balanced in powers of two: draw the next larger one and keep its beginning.
    return np.asarray(qmc.Sobol(d=2, rng=rng).random_base2(math.ceil(math.log2(count)))[:count])
