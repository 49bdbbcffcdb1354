"""Pulls of the tendons as their load cells show them, against what the spools should make of the tendons."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.board.messages import AXES, Pulls
from wristctl.config.hw_run import RigSettings
from wristctl.trial.rig_words import AGAINST, CELL, LOST
from wristctl.trial.safety import SafetyStop
from wristctl.trial.weighing import at_an_end, newtons
from wristctl.wrist.directions import ACTIVE

# Seconds after the board's start within which amplifiers may be settling; at 10 conversions a second it takes them 0.4.
_SETTLING = 1.0
# Conversions of which an amplifier takes the mean, and one that may not have been read yet; seconds on the way to here.
_CONVERSIONS, _UNDERWAY = 5, 0.03
# Share of its least possible pull that a tendon shows at least.
_SHOWN = 0.25
# A tendon that is beyond its limit by this share has part in what is wrong.
_PART = 0.5

_AGAINST = (
    f"{AGAINST}: they are shorter than at homing, or motors make steps that nobody counts (wires beside motor wires)"
)
_FIX = "cut the motors' supply, slacken the tendons by hand, and look (documentation: Load cells)"
_CELL_FIX = (
    "see its plugs, and that DOUT and PD_SCK are not exchanged, by wristctl hw weigh (documentation: Load cells)"
)


class _Past(NamedTuple):
    clock: float
    stretch: Array


class TendonPulls:
    """The newest pulls of a rig with load cells. SI units; values (4,) are of the board's axes."""

    def __init__(self, settings: RigSettings) -> None:
        cells = settings.load_cells
        assert cells is not None
        self._cells = cells
        self._limits = settings.safety
        self._window = _CONVERSIONS / cells.rate + _UNDERWAY
        self._past: deque[_Past] = deque()
        self._more, self._least = np.zeros(AXES), np.zeros(AXES)
        self.pull = np.full(AXES, math.nan)
        """Pulls [N]; nan of a cell that gives nothing."""
        self.age = np.zeros(AXES)
        """Time since each cell has been read [s]; of one at the end of its range as if it gave nothing."""

    @property
    def most(self) -> float:
        """Largest pull that there may be: of what tendons and wrist bear, and what the motors should hold."""
        return min(self._limits.tension, self._limits.motor_pull)

    def take(self, pulls: Pulls) -> None:
        """Take in a reading."""
        counts, age = np.array(pulls.counts, float), np.array(pulls.age)
        settling = pulls.time < _SETTLING
        ended = at_an_end(counts)
        silent = (age > self._limits.cell_age) | ended
        self.age = np.where(silent & settling, 0.0, np.where(ended, math.inf, age))
        self.pull = np.where(silent, math.nan, newtons(self._cells, counts))

    def judge(self) -> None:
        """Raises SafetyStop where a cell is silent, or a tendon beside motors that stand pulls beyond all limits."""
        if self.age.max() > self._limits.cell_age:
            raise SafetyStop(f"no reading of a load cell: {self.causes('cell_age')}", fix=self.fix("cell_age"))
        if np.nanmax(self.pull, initial=0.0) > self.most:
            problem = f"a tendon pulls {np.nanmax(self.pull):.0f} N by its load cell, beyond {self.most:.0f} N"
            raise SafetyStop(f"{problem}; likely {self.causes('measured_pull')}", fix=self.fix("measured_pull"))

    def residuals(self, clock: float, stretch: Array) -> dict[str, float]:
        """Residuals of load cells at a time, with tendons stretched so far [m] by their spools (negative: slack).

        A reading is the mean of some time before. So it is compared with all that spools have made of tendons since:
        what those of `safety.stiffest` may pull at most, and those of `safety.softest` at least.
        """
        self._past.append(_Past(clock, stretch))
        while clock - self._past[0].clock > self._window:
            self._past.popleft()
        stretches = np.maximum(np.array([past.stretch for past in self._past]), 0.0)
        self._more = self.pull - self._limits.stiffest * stretches.max(axis=0)
        least = self._limits.softest * stretches.min(axis=0)
        self._least = np.where(self.pull < _SHOWN * least, least, 0.0)
        return {
            "cell_age": float(self.age.max()),
            "measured_pull": _largest(self.pull),
            "excess_pull": max(0.0, _largest(self._more)),
            "missing_pull": float(self._least.max()),
        }

    @staticmethod
    def fix(name: str) -> str:
        """What to do about a residual beyond its limit."""
        return _CELL_FIX if name == "cell_age" else _FIX

    def causes(self, name: str) -> str:
        """Likely causes of a residual's size, with the tendons that have part in it."""
        if name == "cell_age":
            named = _named(self.age > self._limits.cell_age)
            return CELL.format(f"the amplifier of {named}")
        if name == "missing_pull":
            named = _named(self._least > _PART * self._least.max())
            return LOST.format(f"the tendon of {named}")
        beyond = self.pull if name == "measured_pull" else self._more
        pulling = beyond > _PART * np.nanmax(beyond)
        if pulling.sum() > 1:
            return f"{_AGAINST}: {_named(pulling)}"
        return (
            f"the tendon of {_named(pulling)} is caught or shorter than at homing, its motor makes steps that nobody "
            "counts, or something holds the wrist"
        )


def _largest(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else math.nan


def _named(axes: NDArray[np.bool_]) -> str:
    return ", ".join(f"axis {axis} (tendon {ACTIVE[axis]})" for axis in np.flatnonzero(axes))


def tendon_pulls_of(settings: RigSettings) -> TendonPulls | None:
    """Pulls of a rig; None where it has no load cells."""
    return None if settings.load_cells is None else TendonPulls(settings)
