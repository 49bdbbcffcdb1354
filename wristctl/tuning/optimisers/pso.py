"""Particle swarm optimisation, the paper's method, with constriction.

Clerc and Kennedy, IEEE Trans. Evolutionary Computation 6 (2002) 58; with clamped velocities as in Eberhart and Shi,
Congress on Evolutionary Computation 2000, 84. The whole swarm knows the best point; its worst fifth tries to leave that
one coordinate at a time, as in elitist learning (Zhan et al., IEEE Trans. Systems, Man, Cybernetics B 39 (2009) 1362).
"""

import math

import numpy as np

from wristctl.arrays import Array
from wristctl.tuning.optimisers.base import Optimiser

# Acceleration towards either best; the two together must exceed 4.
_PULL = 2.05
# 0.7298: the swarm converges for any pull (Clerc and Kennedy, eq. 4).
_CONSTRICTION = 2.0 / (2.0 * _PULL - 2.0 + math.sqrt(4.0 * _PULL**2 - 8.0 * _PULL))
# Largest step of a coordinate, a twentieth of the box: longer ones settle later.
_FASTEST = 0.05
# Standard deviation of a leap from the swarm's best point, along one coordinate.
_LEAP = 0.1


class ParticleSwarm(Optimiser):
    """Particles that remember their own best point and are drawn to it and to the swarm's."""

    name = "pso"

    def __init__(self, dim: int, candidates: int, start: Array, rng: np.random.Generator) -> None:
        super().__init__(dim, candidates, start, rng)
        self.velocity = rng.uniform(-_FASTEST, _FASTEST, self.points.shape)
        self.own, self.own_values = self.points.copy(), np.full(candidates, np.inf)

    def propose(self) -> Array:
        """Move or let leap every particle; at a wall it stops, so that an optimum on the wall can be met exactly."""
        to_own, to_swarm = self.rng.random((2, *self.points.shape))
        pull = _PULL * (to_own * (self.own - self.points) + to_swarm * (self.best.point - self.points))
        self.velocity = np.clip(_CONSTRICTION * (self.velocity + pull), -_FASTEST, _FASTEST)
        moved = self.points + self.velocity
        inside = np.clip(moved, 0.0, 1.0)
        self.velocity[moved != inside] = 0.0
        worst = np.argsort(-self.own_values, kind="stable")[: len(inside) // 5]
        along = self.rng.integers(inside.shape[1], size=len(worst))
        inside[worst] = self.best.point
        inside[worst, along] += _LEAP * self.rng.standard_normal(len(worst))
        return np.clip(inside, 0.0, 1.0)

    def learn(self, values: Array) -> None:
        """Remember each particle's own best point."""
        better = values < self.own_values
        self.own[better], self.own_values[better] = self.points[better], values[better]
