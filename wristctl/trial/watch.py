"""Computes every residual of a loop, tick by tick, and stops it by their limits."""

import math
from collections import Counter, deque
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import State
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.response import Estimate
from wristctl.trial.blind_model import BlindModel
from wristctl.trial.likely_causes import Evidence, likely_causes, reversals
from wristctl.trial.marker_lag import MarkerLag
from wristctl.trial.residuals import RESIDUALS, Judge, Limit, limits_of, notes, stopped_by, worst
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.tendon_pulls import TendonPulls
from wristctl.trial.tick_timing import FIX, TickTiming
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.wrist.directions import away_of

# Seconds over which causes are judged, and whether the loop swings.
_HISTORY, _SWINGING = 0.2, 1.0
# Seconds between two frames from which the wrist may have gone anywhere.
_SUCCESSIVE = 0.06
# Frames at rest at zero by whose median the bend across is none.
_REFERENCE_FRAMES = 5
# Seconds that are summed up: of ticks, of lapsed rates and repeated pictures, of usable angles and commands sent again.
_TICKS, _EVENTS, _SEEN = 0.5, 1.0, 2.0
_FIX = "cut the motors' supply, slacken the tendons by hand, and look; docs/hardware/faults.md says how each shows"
_FOLLOWING = "jump", "across", "load", "apart"


class Tick(NamedTuple):
    """What is there to be looked at at a tick; SI units."""

    clock: float
    late: float
    """Delay with the ticks that were skipped before."""
    estimate: Estimate
    position: Array
    """Spools, (4,) [steps], reeled in."""
    taut: Array
    """Taut lengths of the tendons at the estimated angle, (4,) [m]."""
    state: State
    lapses: int
    """Step rates that have outlived their life, as the board counts, modulo 256."""
    resent: int
    """Commands sent again, as the host counts."""


class Frame(NamedTuple):
    """A usable frame, against what spools should have made of the wrist at its capture; SI units."""

    captured: float
    seen: float
    predicted: Array
    """Angles with tendons as believed and as soft as may be, (2,)."""
    away: float
    """Bend away from the camera, by the size of the tip's marker; nan where it is not known."""


class _Past(NamedTuple):
    clock: float
    frame: Frame
    position: Array


class _Recent:
    """Values of the last so many seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._values = seconds, deque[tuple[float, float]]()

    def add(self, clock: float, value: float = 1.0) -> None:
        self._values.append((clock, value))

    def values(self, clock: float) -> list[float]:
        while self._values and clock - self._values[0][0] >= self._seconds:
            self._values.popleft()
        return [value for _, value in self._values]


class Watch:
    """Residuals of one loop, which begins with the wrist at rest at zero: the marker's size is that of no bend across.

    `oblique` is how far off square an uncalibrated camera looks [rad]. `pulls` are those of a rig with load cells.
    """

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, plane: str, timing: TickTiming, oblique: float = 0.0,
        pulls: TendonPulls | None = None,
    ) -> None:  # fmt: skip
        self._settings, self._timing, self._oblique, self._pulls = settings, timing, oblique, pulls
        self._plus, self._away = tuple(on_plus_side(plane).tolist()), away_of(plane, settings.markers.positive)
        self._spools, self._period = spools_of(settings.actuator), timing.period
        self._blind = BlindModel(wrist, settings.actuator, settings.safety.softest, settings.sensor, self._period)
        self._nearer = 2.0 * settings.markers.distance / wrist.length
        self.limits = limits_of(settings)
        self._judge = Judge(self.limits)
        self._frame: Frame | None = None
        self._straight: list[float] = []
        self._base: Array | None = None
        self._moved = 0.0
        self._past: deque[_Past] = deque()
        self._positions: deque[Array] = deque(maxlen=round(_SWINGING / self._period))
        self._counts: tuple[int, int] | None = None
        self._trips, self._skipped, self._blamed = _Recent(_TICKS), _Recent(_TICKS), _Recent(_TICKS)
        self._lapsed, self._repeated = _Recent(_EVENTS), _Recent(_EVENTS)
        self._usable, self._resent = _Recent(_SEEN), _Recent(_SEEN)
        self._began: float | None = None
        self._values: dict[str, float] = {}
        self.begin()

    def begin(self, pushed: bool = False) -> None:
        """A motion begins; whether a person pushes in it."""
        self._pushed, self._lag = pushed, MarkerLag()
        self.most: dict[str, float] = {}
        """Largest of each residual in the motion."""

    def words(self) -> str:
        """What was odd in the motion, in one line."""
        return "; ".join(notes(self.most, self.limits))

    def predict(self, reeled_plus: float, reeled_minus: float) -> None:
        """Go on to the next tick, with the sides reeled in by so much [m] until then."""
        self._blind.predict(reeled_plus, reeled_minus)

    def sighted(self, sighting: Sighting, clock: float) -> None:
        """Take in any picture."""
        if sighting.verdict in (SightingVerdict.FROZEN, SightingVerdict.STAMP):
            self._repeated.add(clock)
        base = sighting.corners[0]
        if not np.isfinite(base).all():
            return
        self._base = base if self._base is None else self._base
        side = math.dist(*self._base[:2])
        self._moved = float(np.hypot(*(base - self._base).mean(axis=0))) / side if side > 0.0 else 0.0

    def saw(self, sighting: Sighting, captured: float, clock: float) -> Frame:
        """Take in a usable frame, taken `captured` seconds after tick 0."""
        away = -self._nearer * math.log(sighting.size)  # a marker at a bend b is b L/2 further off
        if math.isfinite(away) and len(self._straight) < _REFERENCE_FRAMES:
            self._straight.append(away)
        known = len(self._straight) == _REFERENCE_FRAMES
        across = away - float(np.median(self._straight)) if known else math.nan
        self._frame = Frame(sighting.time, sighting.theta, self._blind.angles(captured), across)
        self._usable.add(clock)
        before, after = (self._blind.angles(captured + half)[0] for half in (-self._period / 2.0, self._period / 2.0))
        self._lag.add(sighting.theta, float(self._frame.predicted[0]), float(after - before) / self._period)
        return self._frame

    def see(self, tick: Tick, last_usable: float) -> dict[str, float]:
        """All residuals of a tick; nan where one is not known yet."""
        self._began = tick.clock if self._began is None else self._began
        self._count(tick)
        finite = all(map(math.isfinite, tick.estimate))
        self._values = {
            "late": tick.late,
            "lapses": float(len(self._lapsed.values(tick.clock))),
            "no_number": float(sum(not math.isfinite(value) for value in tick.estimate)),
            "angle": tick.estimate.theta,
            "rate": tick.estimate.rate,
            "age": tick.clock - last_usable,
            "pull": max(0.0, float(self._spools.tension(tick.position, tick.taut).max())) if finite else math.nan,
            **self._weighed(tick.clock, tick.position, tick.taut),
            "travel": float(np.abs(tick.position).max()) * self._spools.step,
            "disabled": float(tick.state != State.ENABLED),
            **self._following(tick),
            **self._of_timing(tick.clock),
            "unseen": self._unseen(tick.clock),
            "repeated": float(len(self._repeated.values(tick.clock))),
            "resent": sum(self._resent.values(tick.clock)),
            "moved": self._moved,
            "lag": self._lag.least(),
        }
        self.most = worst(self._values, self.most)
        return self._values

    def judge(self, tick: Tick) -> None:
        """Raises SafetyStop where a residual of the tick last seen is beyond its limit for long enough."""
        beyond = self._judge.beyond(tick.clock, self._values)
        if beyond is not None:
            raise self._stop(beyond, tick)

    def _weighed(self, clock: float, position: Array, taut: Array) -> dict[str, float]:
        stretch = self._spools.step * position - taut
        return {} if self._pulls is None else self._pulls.residuals(clock, stretch)

    def standing(self, theta: float, position: Array, taut: Array, clock: float) -> None:
        """Raises SafetyStop where a wrist whose motors stand is bent, or its tendons are pulled, beyond the limits."""
        pull = max(0.0, float(self._spools.tension(position, taut).max()))
        values = {"angle": theta, "pull": pull, **self._weighed(clock, position, taut)}
        for limit in self.limits:
            value = values.get(limit.name, 0.0)
            if abs(value) > limit.limit:
                raise SafetyStop(stopped_by(limit, value) + self._named(limit.name), fix=RESIDUALS[limit.name].causes)

    def ticked(self, clock: float, round_trip: float, skipped: int, culprit: str) -> None:
        """A tick has ended: its command's round trip, the ticks after it that are skipped, and by whose fault."""
        self._trips.add(clock, round_trip)
        self._skipped.add(clock, skipped)
        self._blamed.add(clock, list(FIX).index(culprit) if skipped else math.nan)

    def _count(self, tick: Tick) -> None:
        lapses, resent = self._counts or (tick.lapses, tick.resent)
        for _ in range((tick.lapses - lapses) & 0xFF):
            self._lapsed.add(tick.clock)
        self._resent.add(tick.clock, tick.resent - resent)
        self._counts = tick.lapses, tick.resent

    def _following(self, tick: Tick) -> dict[str, float]:
        if self._frame is None:
            return dict.fromkeys(_FOLLOWING, math.nan) | {"load": tick.estimate.load}
        self._past.append(_Past(tick.clock, self._frame, tick.position))
        self._positions.append(tick.position)
        while tick.clock - self._past[0].clock > _HISTORY:
            self._past.popleft()
        frame = self._frame
        apart = frame.seen - float(np.clip(frame.seen, frame.predicted.min(), frame.predicted.max()))
        jump = _jump(self._past[-2].frame, frame) if len(self._past) > 1 else 0.0
        return {"jump": jump, "across": frame.away, "load": tick.estimate.load, "apart": apart}

    def _of_timing(self, clock: float) -> dict[str, float]:
        trips, skipped = self._trips.values(clock), sum(self._skipped.values(clock))
        if self._began is None or clock - self._began < _TICKS or not trips:
            return {"round_trip": math.nan, "skipped": math.nan}
        return {"round_trip": float(np.median(trips)), "skipped": skipped / (skipped + len(trips))}

    def _unseen(self, clock: float) -> float:
        sensor = self._settings.sensor
        usable, since = len(self._usable.values(clock)), clock - (clock if self._began is None else self._began)
        expected = min(since, _SEEN) * sensor.frame_rate * (1.0 - sensor.dropped)
        return 1.0 - (usable + 1.0) / expected if since > 0.5 * _SEEN else math.nan

    def _stop(self, limit: Limit, tick: Tick) -> SafetyStop:
        name, fix = limit.name, RESIDUALS[limit.name].causes
        problem = stopped_by(limit, self._values[name])
        if name == "age":
            why, fix = self._timing.camera.missing(tick.clock, limit.limit)
            problem += f" ({why})"
        elif name == "disabled":
            problem = f"the board is {tick.state.name}, not ENABLED"
        elif name == "skipped":
            blamed = Counter(who for who in self._blamed.values(tick.clock) if math.isfinite(who))
            culprit = list(FIX)[int(blamed.most_common(1)[0][0])]
            problem, fix = f"{problem}: {culprit}", FIX[culprit]
        elif RESIDUALS[name].weighed:
            problem += self._named(name)
        elif name in _FOLLOWING:
            problem, fix = f"{problem}; likely {', or '.join(self._causes()[:4])}", _FIX
        return SafetyStop(problem, fix=fix)

    def _named(self, name: str) -> str:
        if self._pulls is None or not RESIDUALS[name].weighed:
            return ""
        return f"; likely {self._pulls.causes(name)}"

    def _causes(self) -> list[str]:
        if not self._past:
            return [RESIDUALS["load"].causes]
        first, last = self._past[0], self._past[-1]
        evidence = Evidence(
            turned=last.position - first.position,
            load=self._values["load"],
            across=0.0 if math.isnan(last.frame.away) else last.frame.away,
            bent=last.frame.seen - first.frame.seen,
            meant=float((last.frame.predicted - first.frame.predicted)[0]),
            jump=max((abs(_jump(one.frame, two.frame)) for one, two in pairwise(self._past)), default=0.0),
            bends=math.radians(self._settings.safety.across_deg),
            reversals=reversals(np.array(self._positions)),
            pushed=self._pushed,
            oblique=self._oblique,
        )
        return likely_causes(evidence, self._plus, self._away)


def _jump(one: Frame, two: Frame) -> float:
    """Jump of a second frame off the motion that the spools should have made since the first; the least of both."""
    if not 0.0 < two.captured - one.captured <= _SUCCESSIVE:
        return 0.0
    jumps = two.seen - one.seen - (two.predicted - one.predicted)
    return float(jumps[np.abs(jumps).argmin()])
