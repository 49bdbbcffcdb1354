"""Motions that a wrist follows: angles with two derivatives over time, worked out where they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array


class Angles:
    """Angle [rad], rate and acceleration over T samples: rows (3, T), which `work` writes into what it is given."""

    def __init__(self, samples: int, work: Callable[[Array], None]) -> None:
        self._samples, self._work = samples, work

    @classmethod
    def of(cls, rows: Array) -> Angles:
        """Angles of known rows, (3, T), which nobody may change from now on."""
        angles = cls(rows.shape[1], lambda out: None)
        angles.rows = _fixed(rows)
        return angles

    @cached_property
    def rows(self) -> Array:
        """The three rows, which are kept, read-only."""
        rows = np.empty((3, self._samples))
        self._work(rows)
        return _fixed(rows)

    def into(self, out: Array) -> None:
        """Write the rows into `out` (3, T); unless they are known already, they are not kept."""
        if "rows" in self.__dict__:
            out[:] = self.rows
        else:
            self._work(out)


class Goals(NamedTuple):
    """Facts of a reference that metrics need: simulated loops, recorded trials and tests are all judged by it.

    In two planes `final` and `move` are vectors (2,).
    """

    final: Any
    """Last reference bend [rad]."""
    move: Any
    """Last move, signed [rad]: bands and overshoot are shares of its size, and overshoot is along it."""
    begin: float
    """When the last move begins [s]."""
    rest: float
    """When the reference rests [s]; the horizon if it never does."""
    horizon: float
    """[s]"""

    @property
    def rows(self) -> Array:
        """As running sums take them: last bend and direction of the last move of each plane, then GOALS."""
        final, move = np.atleast_1d(self.final), np.atleast_1d(self.move)
        size = float(np.hypot(*move)) if len(move) > 1 else abs(float(move[0]))
        toward = move / size if len(move) > 1 and size > 0.0 else np.where(move < 0.0, -1.0, 1.0)
        return np.array([*final, *toward, size, self.begin, self.rest, self.horizon])


# Rows of goals behind those of each plane.
GOALS = ("move", "begin", "rest", "horizon")


def goals_of_bends(bends: Array, time: Array) -> Goals:
    """Goals of a path of bends (P, T) [rad] at times (T,) [s]: one move, from straight to where it ends."""
    step = float(time[1] - time[0])
    moving = np.flatnonzero(np.diff(bends, axis=1).any(axis=0))
    horizon = len(time) * step
    rest = 0.0 if not len(moving) else float(time[moving[-1] + 1])
    return Goals(bends[:, -1], bends[:, -1], 0.0, rest if rest < time[-1] - 0.5 * step else horizon, horizon)


@dataclass(frozen=True)
class Motion:
    """A reference on the sample grid, T samples from t = 0; SI units."""

    time: Array
    angles: Angles
    """The reference with two derivatives."""
    tips: Array | Callable[[], Array]
    """The wanted tip positions, (T, 2) [m], or what works them out once they are asked for."""
    turn: float | None
    """Last move of the reference, signed [rad]; None: from straight to where it ends."""
    begin: float
    """Time at which the last move begins."""
    rest: float
    """Time at which the reference rests; the horizon if it never does."""
    horizon: float
    outside: float = 0.0
    """Share of samples whose tip position lies outside the domain that the network was trained on."""
    wanted: Angles | None = None
    """Angles that are truly wanted, where a network only approximates them."""

    @property
    def theta_ref(self) -> Array:
        """The reference angle, (T,) [rad]."""
        theta: Array = self.angles.rows[0]
        return theta

    @property
    def rate_ref(self) -> Array:
        """Rate of the reference, (T,) [rad/s]."""
        rate: Array = self.angles.rows[1]
        return rate

    @property
    def acceleration_ref(self) -> Array:
        """Acceleration of the reference, (T,) [rad/s^2]."""
        acceleration: Array = self.angles.rows[2]
        return acceleration

    @property
    def theta_desired(self) -> Array:
        """The true wanted angle, (T,) [rad], which a network only approximates."""
        theta: Array = (self.wanted or self.angles).rows[0]
        return theta

    @cached_property
    def tip_desired(self) -> Array:
        """The wanted tip position, (T, 2)."""
        return self.tips() if callable(self.tips) else self.tips

    @property
    def final(self) -> float:
        """Last reference angle [rad]."""
        return float(self.theta_ref[-1])

    @property
    def goals(self) -> Goals:
        """Facts of the motion that metrics need."""
        return self.goals_at(self.final)

    def goals_at(self, final: float) -> Goals:
        """Facts of the motion that metrics need, by its last angle [rad], where that is known already."""
        return Goals(final, final if self.turn is None else self.turn, self.begin, self.rest, self.horizon)


def _fixed(rows: Array) -> Array:
    rows.setflags(write=False)
    return rows
