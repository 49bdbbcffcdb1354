"""One coordinate after another, around the best point so far."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wristctl.tuning.optimisers.base import Optimiser

Array = NDArray[np.float64]


class CoordinateSearch(Optimiser):
    """Candidates that differ from the best in one coordinate each, by less and less."""

    name = "coordinates"

    def propose(self) -> Array:
        """Steps in turn along each axis."""
        count, dim = self.points.shape
        moved = np.tile(self.best.point, (count, 1))
        moved[np.arange(count), np.arange(count) % dim] += self.rng.uniform(-0.2, 0.2, count)
        return np.clip(moved, 0.0, 1.0)

    def learn(self, values: Array) -> None:
        """The best point is all there is to know."""
