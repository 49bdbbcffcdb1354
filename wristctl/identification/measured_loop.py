"""A loop that somebody measured: time, angle, and at the spools positions, pulls or both, from a CSV file.

The header names each column with its unit, as `time [s],angle [deg],spool_plus [mm],spool_minus [mm]`, in any order;
lines that begin with # say nothing. The + side is the one that pulls the angle up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.errors import UserError
from wristctl.config.wrist import WristParameters
from wristctl.records.measured_table import ANGLE, LENGTH, TIME, Expected

_FORCES = {"N": 1.0}
LOOP_TABLE = Expected(
    "measured loop",
    {
        "time": TIME,
        "angle": ANGLE,
        "spool_plus": LENGTH,
        "spool_minus": LENGTH,
        "tension_plus": _FORCES,
        "tension_minus": _FORCES,
    },
    needed=("time", "angle"),
    example="time [s],angle [deg],spool_plus [mm],spool_minus [mm]",
)
"""The columns that there may be, and their units; a tension is one tendon's at its spool, a side has two alike."""
_FEWEST = 100
_TREMBLE = 0.05
"""Share of its whole way that what drives a loop goes back by before that is a turn."""
_MEDIAN = 0.6745
"""Median of the absolute value of a normal variable, over its standard deviation."""
_NOISE = 0.05
"""Share of the largest tension by which noise may take one below nothing."""
_APART = 3.0
"""By which factor spools may go further, or less far, than the angle asks for."""


@dataclass(frozen=True)
class MeasuredLoop:
    """T samples, SI units; spools and tensions (T, 2) are of the + and the - side, None where not measured."""

    name: str
    time: Array
    angle: Array
    spools: Array | None
    tensions: Array | None

    @property
    def winch(self) -> bool:
        """Whether only the pulls at the spools are known, not where these are."""
        return self.spools is None

    @property
    def drive(self) -> Array:
        """What the wrist is driven by, (T, 2)."""
        found = self.tensions if self.spools is None else self.spools
        assert found is not None
        return found

    @property
    def tremble(self) -> float:
        """Standard deviation [N] of noise in pulls that drive it, by how far a sample lies beside its neighbours' mean;
        0 where spools do."""
        if not self.winch:
            return 0.0
        beside = np.abs(np.diff(self.drive, 2, axis=0)) / math.sqrt(6.0)
        return float(np.median(beside)) / _MEDIAN

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """Samples at which what drives it turns round; small trembles do not count."""
        pulled = self.drive[:, 0] - self.drive[:, 1]
        least, found, sign, begin = _TREMBLE * float(np.ptp(pulled)), list[int](), 1.0 if self.rises else -1.0, 0
        while True:
            onward = sign * pulled[begin:]
            back = np.flatnonzero(np.maximum.accumulate(onward) - onward > least)
            if not len(back):
                return np.array(found, np.int64)
            begin += int(np.argmax(onward[: back[0]]))
            found.append(begin)
            sign = -sign

    @property
    def rises(self) -> bool:
        """Whether it begins on its way up."""
        pulled = self.drive[:, 0] - self.drive[:, 1]
        away = np.flatnonzero(np.abs(pulled - pulled[0]) > _TREMBLE * float(np.ptp(pulled)))
        return bool(pulled[away[0]] > pulled[0])


def read_loop(file: Path, wrist: WristParameters) -> MeasuredLoop:
    """A measured loop. Raises UserError for a file that is none, with line and column, and what would mend it."""
    read = LOOP_TABLE.read(file)
    known = read.columns
    spools, tensions = (_pair(known, name, str(file)) for name in ("spool", "tension"))
    if spools is None and tensions is None:
        raise UserError("neither spools nor tensions", str(file), f"columns of both sides, as in {LOOP_TABLE.example}")
    found = MeasuredLoop(file.name, known["time"], known["angle"], spools, tensions)
    _check(found, wrist, str(file), read.lines)
    return found


def _pair(known: Mapping[str, Array], name: str, where: str) -> Array | None:
    sides = [f"{name}_plus", f"{name}_minus"]
    there = [side for side in sides if side in known]
    if len(there) == 1:
        lacking = next(side for side in sides if side not in known)
        raise UserError(f"{there[0]} without {lacking}", where, "both sides, or none")
    return np.stack([known[side] for side in sides], axis=1) if there else None


def _check(loop: MeasuredLoop, wrist: WristParameters, file: str, lines: Sequence[int]) -> None:
    if len(loop.time) < _FEWEST:
        raise UserError(f"{len(loop.time)} samples, too few to tell", file, f"at least {_FEWEST}")
    back = np.flatnonzero(np.diff(loop.time) <= 0.0)
    if len(back):
        raise UserError("time does not go on", f"{file}:{lines[back[0] + 1]}", "samples in the order of their times")
    most = float(np.abs(loop.angle).max())
    if most > 2.0 * math.radians(wrist.range_deg):
        told = f"it bends by {math.degrees(most):.3g} deg, the wrist's range is {wrist.range_deg:g} deg"
        raise UserError(told, file, "the angle's unit in the header, or wrist.range_deg")
    if loop.tensions is not None:
        pushes = loop.tensions.min(axis=1) < -_NOISE * loop.tensions.max()
        if pushes.any():
            where = f"{file}:{lines[int(np.argmax(pushes))]}"
            raise UserError("a tendon pushes", where, "tensions of 0 N or more: is the load cell's zero right?")
    moved = loop.drive - loop.drive.mean(axis=0)
    together = float(np.sum((moved[:, 0] - moved[:, 1]) * (loop.angle - loop.angle.mean())))
    if together <= 0.0:
        what = "where the + side reels in or pulls, the angle falls" if together < 0.0 else "nothing moves"
        raise UserError(what, file, "the sign of the angle, or plus and minus in the header the other way round")
    if not len(loop.turns):
        raise UserError("it never turns round", file, "record there and back, two cycles or more")
    if loop.spools is not None:
        share = float(np.ptp(loop.spools[:, 0])) / (wrist.tendon_offset * float(np.ptp(loop.angle)))
        if not 1.0 / _APART < share < _APART:
            what = f"spools move {share:.2g} times as far as this angle takes with wrist.tendon_radius"
            raise UserError(what, file, "the units in the header, or wrist.tendon_radius")
