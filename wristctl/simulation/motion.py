"""Motions that a wrist follows: bends with two derivatives over time, worked out where they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

# Rows of a reference in one plane: bend, rate and acceleration.
DERIVATIVES = 3


class Angles:
    """Bend [rad], rate and acceleration over T samples in each of P planes: rows (3 P, T), plane by plane.

    `work` writes them into what it is given.
    """

    def __init__(self, samples: int, work: Callable[[Array], None], planes: int = 1) -> None:
        self._samples, self._work, self.planes = samples, work, planes

    @classmethod
    def of(cls, rows: Array) -> Angles:
        """Angles of known rows, (3 P, T), which nobody may change from now on."""
        angles = cls(rows.shape[1], lambda out: None, len(rows) // DERIVATIVES)
        angles.rows = _fixed(rows)
        return angles

    @cached_property
    def rows(self) -> Array:
        """The rows, which are kept, read-only."""
        rows = np.empty((DERIVATIVES * self.planes, self._samples))
        self._work(rows)
        return _fixed(rows)

    def into(self, out: Array) -> None:
        """Write the rows into `out` (3 P, T); unless they are known already, they are not kept."""
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
    """A reference on the sample grid, T samples from t = 0; SI units.

    What is of each plane is (T,) in one plane, and (T, 2) in two, toward ulnar and toward flexion.
    """

    time: Array
    angles: Angles
    """The reference with two derivatives."""
    tips: Array | Callable[[], Array]
    """The wanted tip positions, (T, P + 1) [m], or what works them out once they are asked for."""
    turn: Any
    """Last move of the reference, signed, of each plane [rad]; None: from straight to where it ends."""
    begin: float
    """Time at which the last move begins."""
    rest: float
    """Time at which the reference rests; the horizon if it never does."""
    horizon: float
    outside: float = 0.0
    """Share of samples whose tip position lies outside the domain that the network was trained on."""
    wanted: Angles | None = None
    """Angles that are truly wanted, where a network only approximates them."""

    @classmethod
    def of_bends(cls, bends: Array, period: float, length: float) -> Motion:
        """A motion in P planes: bends with two derivatives (P, 3, T), sampled every `period` [s].

        It is one move, from straight to where it ends; tips are those of one arc of this length [m].
        """
        planes, _, samples = bends.shape
        time, wanted = period * np.arange(samples, dtype=np.float64), np.array(bends[:, 0].T)
        goals = goals_of_bends(wanted.T, time)
        angles = Angles.of(np.ascontiguousarray(bends, np.float64).reshape(DERIVATIVES * planes, samples))
        tips = partial(spatial_tips, wanted, length)
        return cls(time, angles, tips, None, goals.begin, goals.rest, goals.horizon)

    @property
    def planes(self) -> int:
        """Planes that it bends in."""
        return self.angles.planes

    @property
    def bend_ref(self) -> Array:
        """The reference bend, (T, P) [rad]."""
        bends: Array = self.angles.rows[::DERIVATIVES].T
        return bends

    @property
    def bend_desired(self) -> Array:
        """The bend that is truly wanted, (T, P) [rad], which a network only approximates."""
        bends: Array = (self.wanted or self.angles).rows[::DERIVATIVES].T
        return bends

    @property
    def theta_ref(self) -> Array:
        """The reference bend, (T,) or (T, 2) [rad]."""
        return self._of(self.angles, 0)

    @property
    def rate_ref(self) -> Array:
        """Rate of the reference, (T,) or (T, 2) [rad/s]."""
        return self._of(self.angles, 1)

    @property
    def acceleration_ref(self) -> Array:
        """Acceleration of the reference, (T,) or (T, 2) [rad/s^2]."""
        return self._of(self.angles, 2)

    @property
    def theta_desired(self) -> Array:
        """The bend that is truly wanted, (T,) or (T, 2) [rad], which a network only approximates."""
        return self._of(self.wanted or self.angles, 0)

    @staticmethod
    def _of(angles: Angles, derivative: int) -> Array:
        rows: Array = angles.rows[derivative::DERIVATIVES]
        return rows[0] if len(rows) == 1 else rows.T

    @cached_property
    def tip_desired(self) -> Array:
        """The wanted tip position, (T, P + 1) [m]."""
        return self.tips() if callable(self.tips) else self.tips

    @property
    def final(self) -> Any:
        """Last reference bend, of two planes (2,) [rad]."""
        return self.theta_ref[-1]

    @property
    def goals(self) -> Goals:
        """Facts of the motion that metrics need."""
        return self.goals_at(self.final)

    def goals_at(self, final: Any) -> Goals:
        """Facts of the motion that metrics need, by its last bend [rad], where that is known already."""
        return Goals(final, final if self.turn is None else self.turn, self.begin, self.rest, self.horizon)


def resting(theta: Array, samples: int, period: float, acceleration: Array | None = None) -> Motion:
    """A motion that rests at bends (P,) [rad] from the start, over so many samples, every `period` [s].

    Laws are told an `acceleration` (P,) [rad/s^2] all the same, where one is given.
    """
    rows = np.zeros((DERIVATIVES * len(theta), samples))
    rows[::DERIVATIVES] = theta[:, None]
    if acceleration is not None:
        rows[2::DERIVATIVES] = acceleration[:, None]
    time, tips = period * np.arange(samples, dtype=np.float64), np.zeros((samples, len(theta) + 1))
    return Motion(time, Angles.of(rows), tips, None, 0.0, 0.0, samples * period)


def _fixed(rows: Array) -> Array:
    rows.setflags(write=False)
    return rows
