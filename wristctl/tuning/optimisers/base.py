"""Base of every optimiser: it proposes candidates in the unit box and learns their values, smaller is better.

An optimiser never calls the objective (ask/tell), so a whole generation is evaluated as one batch. A method is one
class: how it proposes the next candidates and what it keeps of their values; `Optimiser` does the rest.
"""

from abc import ABC, abstractmethod
from typing import NamedTuple, final

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError


class Best(NamedTuple):
    """The best candidate so far, (dim,), and its value; inf while every candidate has failed."""

    point: Array
    value: float


class Optimiser(ABC):
    """Minimises over [0, 1]^dim with `candidates` points at a time, the first of them being `start`.

    The same generator state and the same values give the same candidates, bit for bit.
    """

    name: str
    least_candidates = 1

    def __init__(self, dim: int, candidates: int, start: Array, rng: np.random.Generator) -> None:
        """UserError for fewer candidates than the method needs; ValueError for a start outside the unit box."""
        if candidates < self.least_candidates:
            least = f"at least {self.least_candidates}"
            raise UserError(f"{self.name} needs {least} candidates, not {candidates}", "tune.candidates", least)
        if start.shape != (dim,) or not np.all((start >= 0.0) & (start <= 1.0)):
            raise ValueError(f"start must be a point of the unit box of {dim} dimensions, not {start}")
        self.rng = rng
        self.points = rng.random((candidates, dim))
        """The candidates asked for last, (candidates, dim)."""
        self.points[0] = start
        self.best = Best(start.copy(), np.inf)
        self._asked = self._told = False

    @final
    def ask(self) -> Array:
        """The next candidates, (candidates, dim); the same ones until `tell` has been called."""
        if self._told:
            self.points = self.propose()
        self._asked, self._told = True, False
        return self.points.copy()

    @final
    def tell(self, values: Array) -> None:
        """Learn the values (candidates,) of the candidates asked for last; inf or nan where one has failed."""
        if not self._asked:
            raise RuntimeError("tell() must follow ask()")
        known = np.where(np.isnan(values), np.inf, values)
        if known.shape != self.points.shape[:1]:
            raise ValueError(f"expected {len(self.points)} values, not an array of shape {known.shape}")
        least = int(np.argmin(known))
        if known[least] < self.best.value:
            self.best = Best(self.points[least].copy(), float(known[least]))
        self.learn(known)
        self._asked, self._told = False, True

    @abstractmethod
    def propose(self) -> Array:
        """The next candidates within the unit box, (candidates, dim), after the first ones."""

    @abstractmethod
    def learn(self, values: Array) -> None:
        """Keep what the method needs of the values (candidates,) of `points`, inf where one has failed."""
