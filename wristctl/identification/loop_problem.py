"""A measured loop as a fit of friction sees it: which samples count, and what the model expects in them.

What a loop tells at once is the capstan's exponent at its mean bend, mu (bend + sheath), by its width, and presliding,
by how soon its corners turn. Only the exponent's change with the bend tells mu from the sheath. So a search goes by the
exponent and by the bend's share of it, bend/(bend + sheath), from 0 (an endless sheath of hardly any friction) to 1 (no
sheath): where the share may be 0, the sheath has no end.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import OpenLog
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.wrist.directions import DIRECTIONS
from wristctl.wrist.statics import FROM_ABOVE, FROM_BELOW
from wristctl.wrist.tendons import TENDONS_PER_SIDE

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


def read_loop(file: Path, wrist: WristParameters, names: str = "", trial: str | None = None) -> MeasuredLoop:
    """A measured loop in an open log. Raises UserError for a file that is none, with line and column.

    `names` are another author's columns as `wristctl.records.open_log` has them, `trial` is that of several to be used.
    A log without times is taken as slow: so much of its way in a second that damping plays no part.
    """
    log = trial_of(read_log(file, names, "measured loop"), trial)
    slow: Array = _SLOWLY * np.arange(len(log), dtype=np.float64)
    time = log.whole("time", _EXAMPLE) if "time" in log.columns else slow
    bend, spools, tensions = planar_bend(log), in_pairs(log, "spool"), in_pairs(log, "tension")
    if spools is None and tensions is None:
        raise UserError("neither spools nor tensions", str(file), f"columns of both sides, as in {_EXAMPLE}")
    loop = MeasuredLoop(file.name, time, bend, spools, tensions)
    _check(loop, wrist, log)
    return loop


def trial_of(log: OpenLog, trial: str | None) -> OpenLog:
    """One trial of a log: the one named, or the only one."""
    trials = log.trials()
    if trial is None and len(trials) == 1:
        return log
    if trial is None or trial not in trials:
        problem = f"{len(trials)} trials" if trial is None else f"no trial {trial}"
        raise UserError(problem, str(log.file), f"name one of them with hysteresis.trial: {', '.join(trials)}")
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


# Coordinates of a search: the exponent, the bend's share of it, logarithms over where it begins, zeros [rad, m]; the
# last three only where spools were measured.
EXPONENT, SHARE, PRESLIDING, STIFFNESS, DAMPING, ANGLE_ZERO, TENDON, SPOOL_PLUS, SPOOL_MINUS = range(9)
# Steps of finite differences.
NUDGES = (1e-4, 1e-4, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-6, 1e-6)
# Start of a search for presliding [m], and its width as a logarithm.
BEGIN_PRESLIDING, WIDEST = 2e-5, math.log(1e3)
# Below it a share is none.
LEAST_SHARE = 1e-4
_BEGIN_FRICTION, _BEGIN_SHEATH = 0.1, 1.0
# Share of the samples that may pass before the first that counts.
_MOST_LOST = 0.7


@dataclass(frozen=True)
class LoopProblem:
    """A measured loop, the wrist as it is believed to be, and what is known beforehand."""

    loop: MeasuredLoop
    wrist: WristParameters
    settings: HysteresisSettings

    @cached_property
    def first(self) -> int:
        """The sample from which on it is used: that of the first turn after a stroke beyond the run-up.

        How the bristles were bent when the recording began is not known; at the end of a stroke they are bent fully.
        """
        strokes = np.abs(np.diff(self.loop.angle[[0, *self.loop.turns]])) * self.wrist.tendon_offset
        long = np.flatnonzero(strokes > self.settings.known.run_up)
        turn = self.loop.turns[long[0]] if len(long) else len(self.loop.time)
        if turn > _MOST_LOST * len(self.loop.time):
            run_up = f"{1e3 * self.settings.known.run_up:g} mm of its tendons' path"
            raise UserError(
                f"too little comes after the first turn that follows a stroke of {run_up}", self.loop.name,
                "record two cycles or more; for small ones lower hysteresis.known.run_up to some times the presliding",
            )  # fmt: skip
        return int(turn)

    @cached_property
    def bend(self) -> float:
        """Mean bend [rad], at which the exponent is meant."""
        return float(np.abs(self.loop.angle[self.first :]).mean())

    @property
    def measured(self) -> list[Array]:
        """Signals for the fit: angle [rad] and, where spools are what moved, both tensions [N]."""
        more = () if self.loop.winch or self.loop.tensions is None else self.loop.tensions.T
        return [signal[self.first :] for signal in (self.loop.angle, *more)]

    @cached_property
    def prior(self) -> Array:
        """One over the standard deviation with which each coordinate is known beforehand; 0 where nothing is."""
        known = self.settings.known
        errors = known.stiffness_error, known.damping_error, math.radians(known.zero_error_deg)
        spools = known.tendon_stiffness_error, known.spool_error, known.spool_error
        return np.array([0.0, 0.0, 0.0, *(1.0 / error for error in (*errors, *(() if self.loop.winch else spools)))])

    def begin(self) -> Array:
        """The coordinates at the start."""
        x = np.zeros(len(self.prior))
        x[EXPONENT] = _BEGIN_FRICTION * (_BEGIN_SHEATH + self.bend)
        x[SHARE] = self.bend / (_BEGIN_SHEATH + self.bend)
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates."""
        low, high = np.full(len(self.prior), -np.inf), np.full(len(self.prior), np.inf)
        low[:3], high[:3] = (0.0, LEAST_SHARE, -WIDEST), (5.0, 1.0, WIDEST)
        return low, high

    def tendons(self, x: Array) -> Actuator:
        """The tendons at coordinates x."""
        return Actuator(level="tendon").model_copy(
            update={
                "friction": x[SHARE] * x[EXPONENT] / self.bend,
                "sheath": self.bend * (1.0 / x[SHARE] - 1.0),
                "presliding": BEGIN_PRESLIDING * math.exp(x[PRESLIDING]),
                "tendon_stiffness": self.settings.tendon_stiffness * math.exp(x[TENDON] if len(x) > TENDON else 0.0),
            }
        )

    def expected(self, candidates: Sequence[Array]) -> list[list[Array]]:
        """Expected measurements at coordinates, as `measured` has it; they run side by side."""
        loop, sides = self.loop, float(TENDONS_PER_SIDE)
        zeros = np.array([(0.0, 0.0) if loop.winch else x[[SPOOL_PLUS, SPOOL_MINUS]] for x in candidates])
        drive = PchipInterpolator(loop.time - loop.time[0], (sides if loop.winch else 1.0) * loop.drive)
        begin = np.full(self.settings.segments, loop.angle[0] / self.settings.segments)
        z = FROM_BELOW if loop.rises else FROM_ABOVE
        lanes = [SpooledWrist(self._wrist(x), self.tendons(x), begin, loop.winch, z) for x in candidates]
        h, lasts = self.settings.step, float(loop.time[-1] - loop.time[0])
        every = max(1, int(0.5 * float(np.median(np.diff(loop.time))) / h))

        def told(time: Array, which: NDArray[np.int64]) -> Array:
            course: Array = drive(time.clip(0.0, lasts))[:, :, None] + zeros[which].T
            return course

        courses = spooled(lanes, told, every * (math.ceil(lasts / (h * every)) + 1) + 1, h, every)
        grid, instants = h * every * np.arange(courses.theta.shape[1]), (loop.time - loop.time[0])[self.first :]
        signals = []
        for lane, x in enumerate(candidates):
            pulls = (
                () if len(self.measured) == 1 else (courses.spool_plus[lane] / sides, courses.spool_minus[lane] / sides)
            )
            signals.append(
                [np.interp(instants, grid, signal) for signal in (courses.theta[lane] + x[ANGLE_ZERO], *pulls)]
            )
        return signals

    def _wrist(self, x: Array) -> WristParameters:
        own = self.wrist.stiffness * math.exp(x[STIFFNESS]), self.wrist.damping * math.exp(x[DAMPING])
        return self.wrist.model_copy(update=dict(zip(("stiffness", "damping"), own, strict=True)))
