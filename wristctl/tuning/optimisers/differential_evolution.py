"""Differential evolution, best/1/bin with a dithered weight.

Storn and Price, J. Global Optimization 11 (1997) 341; the bounce off the walls as in Price, Storn and Lampinen,
Differential Evolution (2005), section 4.3.
"""

import numpy as np

from wristctl.arrays import Array
from wristctl.tuning.optimisers.base import Optimiser

# Range of the weight of differences, drawn anew for every generation.
_WEIGHT = (0.5, 1.0)
# Probability with which a coordinate is taken from the mutant.
_CROSSOVER = 0.7


class DifferentialEvolution(Optimiser):
    """A population whose members are replaced by crosses of the best point with differences of others."""

    name = "differential-evolution"
    least_candidates = 3

    def __init__(self, dim: int, candidates: int, start: Array, rng: np.random.Generator) -> None:
        super().__init__(dim, candidates, start, rng)
        self.population, self.values = self.points.copy(), np.full(candidates, np.inf)

    def propose(self) -> Array:
        """One trial for every member."""
        count, dim = self.population.shape
        member = np.arange(count)
        first = (member + self.rng.integers(1, count, count)) % count
        second = (member + self.rng.integers(1, count - 1, count)) % count
        second = np.where(second == first, (member - 1) % count, second)
        mutant = self.best.point + self.rng.uniform(*_WEIGHT) * (self.population[first] - self.population[second])
        inside = np.clip(mutant, 0.0, 1.0)
        bounced = self.best.point + self.rng.random((count, dim)) * (inside - self.best.point)
        mutant = np.where(mutant == inside, mutant, bounced)
        crossed = self.rng.random((count, dim)) < _CROSSOVER
        crossed[member, self.rng.integers(0, dim, count)] = True
        return np.where(crossed, mutant, self.population)

    def learn(self, values: Array) -> None:
        """A trial that is no worse takes its member's place."""
        kept = values <= self.values
        self.population[kept], self.values[kept] = self.points[kept], values[kept]
