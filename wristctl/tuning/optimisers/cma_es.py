"""CMA-ES: normal candidates whose covariance learns the shape of the valley; the package `cma` is its author's.

Hansen and Ostermeier, Evolutionary Computation 9 (2001) 159; walls by pycma's transformation of the box.
"""

from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.tuning.optimisers.base import Optimiser

# First standard deviation, as Hansen has it for an optimum somewhere in a unit box.
_STEP = 0.3


class CMAES(Optimiser):
    """A normal distribution that moves, grows and turns; where it has converged, another from a place drawn anew."""

    name = "cma-es"
    least_candidates = 4

    def __init__(self, dim: int, candidates: int, start: Array, rng: np.random.Generator) -> None:
        """UserError where the package is missing."""
        super().__init__(dim, candidates, start, rng)
        self._begin(start)
        self.points = self.propose()
        self.points[0] = start

    def _begin(self, start: Array) -> None:
        try:
            from cma import CMAEvolutionStrategy
        except ImportError:
            fix = "pip install 'wristctl[cma]', or take another optimiser"
            raise UserError("cma-es needs the package cma, which is not installed", "tune.optimiser", fix) from None
        own = {"randn": lambda *shape: self.rng.standard_normal(shape), "seed": np.nan}
        quiet = {"verbose": -9, "verb_log": 0, "signals_filename": ""}
        limits = {"bounds": [0.0, 1.0], "maxstd": np.inf}  # pycma's own limit of a deviation fails in one dimension
        given = {**limits, "popsize": len(self.points), **own, **quiet}
        self._strategy: Any = CMAEvolutionStrategy(start, _STEP, given)

    def propose(self) -> Array:
        """Draw from the distribution as it is by now."""
        if self._strategy.stop():
            self._begin(self.rng.random(self.points[0].shape))
        drawn: Array = np.clip(self._strategy.ask(), 0.0, 1.0)
        return drawn

    def learn(self, values: Array) -> None:
        """Only the order counts: a failure is worse than anything known."""
        known = values[np.isfinite(values)]
        worst = known.max() + np.ptp(known) + 1.0 if len(known) else 0.0
        self._strategy.tell(list(self.points), np.where(np.isfinite(values), values, worst))
