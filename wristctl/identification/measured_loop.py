"""A measured loop: one motion to and fro in one plane, as an open log has it."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records.log_looks import telling
from wristctl.records.open_log import OpenLog
from wristctl.wrist.directions import DIRECTIONS

_EXAMPLE = "time [s],angle [deg],spool_plus [mm],spool_minus [mm]"
_FEWEST = 100
# Share of its whole way that what drives a loop goes back by before that is a turn.
_TREMBLE = 0.05
# Median of the absolute value of a normal variable, over its standard deviation.
_MEDIAN = 0.6745
# Share of the largest tension by which noise may take one below nothing.
_NOISE = 0.05
# Time between two samples of a log without times [s].
_SLOWLY = 0.1
# Bend beside its plane that a wrist may show [rad].
_OUT_OF_PLANE = math.radians(5.0)
# By which factor spools may go further, or less far, than the angle asks for.
_APART = 3.0


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
        """Input of the wrist: spools or tensions, (T, 2)."""
        measured = self.tensions if self.spools is None else self.spools
        assert measured is not None
        return measured

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
        least, turns, sign, begin = _TREMBLE * float(np.ptp(pulled)), list[int](), 1.0 if self.rises else -1.0, 0
        while True:
            onward = sign * pulled[begin:]
            back = np.flatnonzero(np.maximum.accumulate(onward) - onward > least)
            if not len(back):
                return np.array(turns, np.int64)
            begin += int(np.argmax(onward[: back[0]]))
            turns.append(begin)
            sign = -sign

    @property
    def rises(self) -> bool:
        """Whether it begins on its way up."""
        pulled = self.drive[:, 0] - self.drive[:, 1]
        away = np.flatnonzero(np.abs(pulled - pulled[0]) > _TREMBLE * float(np.ptp(pulled)))
        return bool(pulled[away[0]] > pulled[0])


def loop_of(log: OpenLog, wrist: WristParameters, trial: str | None = None) -> MeasuredLoop:
    """A measured loop in an open log, or in a `trial` of it. Raises UserError for a log that is none, with its line.

    A log without times is taken as slow: so much of its way in a second that damping plays no part.
    """
    log = trial_of(telling(log), trial)
    slow: Array = _SLOWLY * np.arange(len(log), dtype=np.float64)
    time = log.whole("time", _EXAMPLE) if "time" in log.columns else slow
    bend, spools, tensions = planar_bend(log), in_pairs(log, "spool"), in_pairs(log, "tension")
    if spools is None and tensions is None:
        raise UserError("neither spools nor tensions", str(log.file), f"columns of both sides, as in {_EXAMPLE}")
    loop = MeasuredLoop(log.file.name, time, bend, spools, tensions)
    _check(loop, wrist, log)
    return loop


def trial_of(log: OpenLog, trial: str | None) -> OpenLog:
    """One trial of a log: the one named, or the only one."""
    trials = log.trials()
    if trial is None and len(trials) == 1:
        return log
    if trial is None or trial not in trials:
        problem = f"{len(trials)} trials" if trial is None else f"no trial {trial}"
        raise UserError(problem, str(log.file), f"name one of them with identify.trial: {', '.join(trials)}")
    return trials[trial]


def planar_bend(log: OpenLog) -> Array:
    """Bend (T,) [rad] of a log whose wrist stays in one plane. Raises UserError where it does not."""
    bends = log.bends()
    if bends is None:
        return log.whole("bend_y", _EXAMPLE)
    across = np.nanmax(bends, axis=0) - np.nanmin(bends, axis=0)
    along, beside = int(across.argmax()), float(across.min())
    if beside > _OUT_OF_PLANE:
        problem = f"the wrist leaves its plane by {math.degrees(beside):.3g} deg"
        raise UserError(problem, str(log.file), "a motion in one plane, bend_y or bend_z alone")
    bend: Array = bends[:, along]
    for name in ("bend_y", "bend_z", "inclination"):
        if name in log.columns:
            log.without_gaps(name)
    return bend


def in_pairs(log: OpenLog, quantity: str) -> Array | None:
    """Spools [m] or tensions [N] of the + and the - side (T, 2): those of two tendons, or means of two pairs."""
    columns = log.tendons(quantity)
    if not columns:
        return None
    if len(columns) == 1:
        there = log.head(f"{quantity}_{next(iter(columns))}")
        lacking = there.replace("plus", "minus") if "plus" in there else there.replace("minus", "plus")
        other = lacking if lacking != there else f"{quantity}_{3 - next(iter(columns))}"
        raise UserError(f"{there} without {other}", str(log.file), "both sides, or none")
    if len(columns) == 2:
        return np.stack(list(columns.values()), axis=1)
    plus, minus = (
        next(d.tendons for d in DIRECTIONS.values() if (d.plane, d.sign) == ("ulnar", sign)) for sign in (1, -1)
    )
    if set(columns) != {*plus, *minus}:
        problem = f"{quantity} of tendons {', '.join(map(str, columns))}"
        raise UserError(problem, str(log.file), f"two sides ({quantity}_1, {quantity}_2), or tendons 1, 2, 4 and 5")
    return np.stack([0.5 * sum(columns[tendon] for tendon in side) for side in (plus, minus)], axis=1)


def _check(loop: MeasuredLoop, wrist: WristParameters, log: OpenLog) -> None:
    file = str(log.file)
    if len(loop.time) < _FEWEST:
        raise UserError(f"{len(loop.time)} samples, too few to tell", file, f"at least {_FEWEST}")
    back = np.flatnonzero(np.diff(loop.time) <= 0.0)
    if len(back):
        raise UserError("time does not go on", log.at(int(back[0]) + 1), "samples in the order of their times")
    most = float(np.abs(loop.angle).max())
    if most > 2.0 * math.radians(wrist.range_deg):
        problem = f"it bends by {math.degrees(most):.3g} deg, the wrist's range is {wrist.range_deg:g} deg"
        raise UserError(problem, file, "the angle's unit in the header, or wrist.range_deg")
    if loop.tensions is not None:
        pushes = loop.tensions.min(axis=1) < -_NOISE * loop.tensions.max()
        if pushes.any():
            where = log.at(int(np.argmax(pushes)))
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
