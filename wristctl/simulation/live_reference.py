"""A reference that comes while the loop runs: the limits within which it is followed, and the record of one.

Wanted bends come at any time, from a decoder or another program. The reference goes after the newest one by a
critically damped second-order filter (Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, 2019)
whose rate and acceleration are limited: laws have a bend with two derivatives, whatever comes. The acceleration's limit
is the rate's over the time constant: from any rate the filter brakes without passing a wanted bend that stands still.
"""

from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import LIVE, Reference
from wristctl.config.section import Parameter
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records.formats import read_table
from wristctl.simulation.reference import ReferenceKind

# Columns of a record beside its time: bend, rate and acceleration in one plane; in two each with the plane's name.
FOLLOWED = ("theta_ref", "rate_ref", "acceleration_ref")
IN_TWO_PLANES = tuple(f"{name}_{plane}" for plane in ("ulnar", "flexion") for name in ("bend_ref", *FOLLOWED[1:]))
# Samples that the filter's time constant has at least.
_SAMPLES = 4
# Part of a period within which a time is a sample's own: sums of periods round.
_SAME = 1e-6


class LiveLimits(NamedTuple):
    """Limits of a live reference, SI units."""

    rate: float
    """Largest rate [rad/s]."""
    smoothing: float
    """Time constant of the filter [s]."""
    range: float
    """Largest bend [rad]."""
    jump: float
    """Largest difference between wanted bends that follow each other [rad]."""
    silence: float
    """Time without a wanted bend after which the reference stops [s]."""
    hold: float
    """Time for which it then holds, before it goes home [s]."""

    @classmethod
    def of(cls, reference: Reference, wrist: WristParameters, period: float) -> Self:
        """Limits of a reference on this wrist, sampled every `period` [s]. Raises UserError for impossible ones."""
        value = reference.value
        for name in ("rate_deg", "smoothing", "limit_deg", "jump_deg", "silence"):
            if value(name) <= 0.0:
                raise UserError(f"{name} of {value(name):g} is no limit", f"reference.{name}", "a number above 0")
        if value("hold") < 0.0:
            raise UserError(f"no time to hold of {value('hold'):g} s", "reference.hold", "0 or more")
        if value("smoothing") < _SAMPLES * period * (1.0 - 1e-9):
            problem = f"smoothing of {value('smoothing'):g} s has less than {_SAMPLES} samples of {period:g} s"
            raise UserError(problem, "reference.smoothing", f"{_SAMPLES * period:g} or more")
        angles = np.radians([value("rate_deg"), min(value("limit_deg"), wrist.range_deg), value("jump_deg")]).tolist()
        rate, most, jump = angles
        return cls(rate, value("smoothing"), most, jump, value("silence"), value("hold"))

    @property
    def acceleration(self) -> float:
        """Largest acceleration [rad/s^2]."""
        return self.rate / self.smoothing


class LimitedReference:
    """Bend, rate and acceleration (P,) of the followed reference; it begins at rest and straight.

    A move to the next sample has a constant acceleration. Within the range of what was wanted it stays by itself: the
    filter passes no bend that stands still, and is pulled less far by a nearer one.
    """

    def __init__(self, limits: LiveLimits, planes: int, period: float) -> None:
        self._limits, self._period = limits, period
        self.bend, self.rate, self.acceleration = np.zeros(planes), np.zeros(planes), np.zeros(planes)

    def toward(self, wanted: Array) -> None:
        """One sample on, after a wanted bend (P,) [rad]."""
        limits = self._limits
        pull = ((wanted - self.bend) / limits.smoothing - 2.0 * self.rate) / limits.smoothing
        self._go(self.rate + self._period * _capped(pull, limits.acceleration))

    def brake(self) -> None:
        """One sample on, coming to rest as soon as the limit of acceleration permits."""
        speed, change = float(np.hypot.reduce(self.rate)), self._period * self._limits.acceleration
        self._go(self.rate * (1.0 - change / speed) if speed > change else 0.0 * self.rate)

    def _go(self, rate: Array) -> None:
        rate = _capped(rate, self._limits.rate)
        self.bend = self.bend + 0.5 * self._period * (self.rate + rate)
        self.acceleration, self.rate = (rate - self.rate) / self._period, rate


def _capped(vector: Array, most: float) -> Array:
    size = float(np.hypot.reduce(vector))
    return vector if size <= most else most / size * vector


def recorded(reference: Reference, record: Path) -> Reference:
    """The reference with this record in place of what comes; one that is not live as it is."""
    return reference.model_copy(update={"file": str(record), "listen": None}) if reference.is_live else reference


def check_law(reference: Reference, name: str, preview: int) -> None:
    """UserError for a live reference, or the record of one, under a law that looks `preview` samples ahead."""
    if reference.kind == LIVE and preview:
        problem = f"{name} looks {preview} samples ahead, and a live reference has no future"
        raise UserError(problem, "controller", "a controller without preview, such as pid-ff or ct-dob")


def followed_bends(reference: Reference, planes: int, time: Array) -> Array:
    """Bends of a record with two derivatives, (P, 3, T) [rad], at times (T,) [s].

    At its own samples it is the record bit for bit; between them the acceleration is constant, as it was followed.
    After the last the bend is held. Raises UserError for a file that is no such record.
    """
    if reference.file is None:
        problem = "a live reference comes while it runs, and only `simulate` and `hw-run` take it so"
        fix = "the record of one: reference.file: results/RUN/data/reference.csv"
        raise UserError(problem, "reference.kind", fix)
    recorded_time, rows = _read(Path(reference.file), planes)
    step = recorded_time[1] - recorded_time[0]
    at = np.clip(np.searchsorted(recorded_time, time + _SAME * step, "right") - 1, 0, len(recorded_time) - 1)
    since = time - recorded_time[at]
    after = np.minimum(at + 1, len(recorded_time) - 1)
    bend, rate, acceleration = rows[:, 0, at], rows[:, 1, at], rows[:, 2, after]
    course = np.stack(
        [bend + (rate + 0.5 * acceleration * since) * since, rate + acceleration * since, acceleration], 1
    )
    own = np.abs(since) <= _SAME * step
    course[:, :, own] = rows[:, :, at[own]]
    ended = (at == len(recorded_time) - 1) & ~own
    course[:, 0, ended], course[:, 1:, ended] = rows[:, :1, -1], 0.0
    return course


def _read(file: Path, planes: int) -> tuple[Array, Array]:
    """Times (T,) and rows (P, 3, T) of a record."""
    names = FOLLOWED if planes == 1 else IN_TWO_PLANES
    try:
        values = read_table(file)[["time", *names]].to_numpy(float)
    except KeyError:
        problem = f"no record of a live reference in {'one plane' if planes == 1 else 'two planes'}"
        fix = f"data/reference.csv of a run in as many planes, with time, {', '.join(names)}"
        raise UserError(problem, str(file), fix) from None
    except (OSError, ValueError) as error:
        raise UserError(f"no record of a live reference: {error}", str(file), "data/reference.csv of a run") from error
    if len(values) < 2:
        raise UserError("a record without samples", str(file), "the record of a run whose trial began")
    for row in np.flatnonzero(~np.isfinite(values).all(axis=1)):
        raise UserError("a sample that is no number", f"{file}:{row + 2}", "the record as the run has it")
    steps = np.diff(values[:, 0])
    for row in np.flatnonzero((steps <= 0.0) | (np.abs(steps - steps[0]) > 1e-3 * abs(steps[0]))):
        raise UserError("samples are not one period apart", f"{file}:{row + 3}", "the record as the run has it")
    return values[:, 0], np.ascontiguousarray(values[:, 1:].T).reshape(planes, len(FOLLOWED), -1)


def _course(reference: Reference, time: Array) -> Array:
    course: Array = followed_bends(reference, 1, time)[0]
    return course


def _described(reference: Reference) -> str:
    return "live" if reference.file is None else f"live, recorded in {Path(reference.file).name}"


LIVE_REFERENCE = ReferenceKind(
    "wanted bends from a UDP socket while the loop runs, or with `file` the record of them (documentation: A live "
    "reference)",
    course=_course,
    described=_described,
    targets="none",
    parameters={
        "rate_deg": Parameter(60.0, "deg/s", "largest rate of the followed reference"),
        "smoothing": Parameter(0.05, "s", "time constant by which it goes after a wanted bend"),
        "limit_deg": Parameter(40.0, "deg", "largest wanted bend; wrist.range_deg if less"),
        "jump_deg": Parameter(15.0, "deg", "a wanted bend so far off the one before waits for the next to confirm it"),
        "silence": Parameter(0.2, "s", "time without a wanted bend after which the reference stops and holds"),
        "hold": Parameter(1.0, "s", "how long it holds before it goes home"),
    },
)
