"""A polynomial of the inputs, fitted by least squares: what a network has to be better than."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.learning.network import Scaler

DEGREE = 5
"""Of the whole term: 21 terms in x and y, 126 with pose and mass."""


@dataclass(frozen=True)
class Polynomial:
    """Sum of factors times powers of the scaled inputs."""

    scaler: Scaler
    powers: NDArray[np.int64]
    """(terms, inputs)"""
    factors: Array
    """(terms,) [rad]"""
    degree: int

    @property
    def multiply_adds(self) -> int:
        """Of one angle."""
        return int(self.powers.size + len(self.factors))

    def angle(self, inputs: Array) -> Array:
        """Bending angles (...) [rad] of inputs (..., D)."""
        return self._terms(inputs) @ self.factors

    def _terms(self, inputs: Array) -> Array:
        scaled = self.scaler.scale(inputs)
        return np.stack([np.prod(scaled**power, axis=-1) for power in self.powers], axis=-1)

    @staticmethod
    def fit(inputs: Array, theta: Array, degree: int = DEGREE) -> Polynomial:
        """The polynomial nearest to the angles (N,) [rad] of inputs (N, D)."""
        everything = product(range(degree + 1), repeat=inputs.shape[1])
        powers = np.array([power for power in everything if sum(power) <= degree])
        empty = Polynomial(Scaler.of(inputs), powers, np.zeros(len(powers)), degree)
        factors: Array = np.linalg.lstsq(empty._terms(inputs), theta, rcond=None)[0].astype(np.float64)
        return Polynomial(empty.scaler, powers, factors, degree)
