"""Computes every residual of a loop, tick by tick, and stops it by their limits."""

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import State
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.response import Estimate
from wristctl.trial.blind_model import BlindModel
from wristctl.trial.camera_record import CameraRecord, Frame, MarkerLag, Recent, jump_between
from wristctl.trial.likely_causes import Evidence, likely_causes, reversals
from wristctl.trial.residuals import Judge, Limit, limits_of, notes, residual, stopped_by, worst
from wristctl.trial.rig_belief import TOWARD, names_of_planes, numbers_of, pull_directions, unit_toward
from wristctl.trial.rig_words import SLOW_CALL, words_of_board, words_of_rig
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.tendon_pulls import TendonPulls
from wristctl.trial.tick_timing import FIX, TickTiming
from wristctl.vision.marker import Sighting
from wristctl.wrist.directions import away_from_camera
from wristctl.wrist.tendon_layout import TendonLayout

# Seconds over which causes are judged, and whether the loop swings.
_HISTORY, _SWINGING = 0.2, 1.0
# Seconds that are summed up: of ticks, of lapsed rates, of commands sent again.
_TICKS, _EVENTS, _SEEN = 0.5, 1.0, 2.0
# Periods after which spools' steps that were counted are old: those of the tick before are one.
_UNHEARD = 2.5
# Share of the limit on a bend across by which what stands may seem to bend.
_DOUBTFUL = 0.5
_FOLLOWING = "jump", "across", "load", "apart"


class Tick(NamedTuple):
    """What is there to be looked at at a tick; SI units. The estimate's values are (P,) each."""

    clock: float
    late: float
    """Delay with the ticks that were skipped before."""
    estimate: Estimate
    position: Array
    """Spools, (T,) [steps], reeled in."""
    taut: Array
    """Taut lengths of the tendons at the estimated angle, (T,) [m]."""
    state: State
    lapses: int
    """Step rates that have outlived their life, as the board counts, modulo 256."""
    resent: int
    """Commands sent again, as the host counts."""
    unheard: float = 0.0
    """Time since the board has counted the spools' steps."""
    tension: Array | None = None
    """Measured tension of each tendon (T,) [N], where a robot of one's own gives any; nan where it gives none."""
    slow: str = ""
    """The call of a robot of one's own that takes long, with its time; empty where none does."""


class _Past(NamedTuple):
    clock: float
    frames: tuple[Frame, ...]
    position: Array


class Watch:
    """Residuals of one loop, which begins with the wrist at rest at zero: the marker's size is that of no bend across.

    `oblique` is how far off square an uncalibrated camera looks [rad]. `pulls` are those of a rig with load cells.
    `stiffness` is what homing has measured of the tendons [N/m]; without it they are as believed. A rig in two planes
    has a camera for each; `plane` then says nothing, and residuals are norms over both.
    """

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, plane: str, timing: TickTiming, oblique: float = 0.0,
        pulls: TendonPulls | None = None, stiffness: float | None = None, layout: TendonLayout | None = None,
    ) -> None:  # fmt: skip
        self._settings, self._timing, self._oblique, self._pulls = settings, timing, oblique, pulls
        self._layout = layout
        planes, own = names_of_planes(settings.planes, plane), settings.rig is not None
        self._seen_in = np.array([unit_toward(TOWARD[name]) for name in planes])
        self._away = away_from_camera(plane, settings.markers.positive) if settings.planes == 1 else np.zeros(2)
        self._words = (words_of_rig if own else words_of_board)(numbers_of(layout), planes)
        self._spools, self._period, self._radius = spools_of(settings.actuator), timing.period, wrist.tendon_radius
        if stiffness is not None:
            self._spools = replace(self._spools, stiffness=stiffness)
        softest = settings.safety.softest
        payload = settings.payload
        self._blind = BlindModel(wrist, settings.actuator, softest, self._period, planes, layout, payload)
        nearer = 2.0 * settings.markers.distance / wrist.length if settings.planes == 1 else math.nan
        doubtful = _DOUBTFUL * math.radians(settings.safety.across_deg)
        self._cameras = tuple(CameraRecord(nearer, doubtful) for _ in range(settings.planes))
        self.limits, self._own = limits_of(settings), own
        self._judge = Judge(self.limits)
        self._past: deque[_Past] = deque()
        self._positions: deque[Array] = deque(maxlen=round(_SWINGING / self._period))
        self._counts: tuple[int, int] | None = None
        self._trips, self._skipped, self._blamed = Recent(_TICKS), Recent(_TICKS), Recent(_TICKS)
        self._lapsed, self._resent = Recent(_EVENTS), Recent(_SEEN)
        self._began: float | None = None
        self._values: dict[str, float] = {}
        self.begin()

    def begin(self, pushed: bool = False) -> None:
        """A motion begins; whether a person pushes in it."""
        self._pushed = pushed
        for camera in self._cameras:
            camera.lag = MarkerLag()
        self.most: dict[str, float] = {}
        """Largest of each residual in the motion."""

    def words(self) -> str:
        """What was odd in the motion, in one line."""
        return "; ".join(notes(self.most, self.limits, self._own))

    def predict(self, reeled: Array) -> None:
        """Go on to the next tick, with so much (T,) [m] reeled in at each place until then."""
        self._blind.predict(reeled)

    def sighted(self, sighting: Sighting, clock: float) -> None:
        """Take in any picture."""
        self._cameras[sighting.plane].sighted(sighting, clock)

    def saw(self, sighting: Sighting, captured: float, clock: float) -> Frame:
        """Take in a usable frame, taken `captured` seconds after tick 0; its angle is its plane's bend."""
        plane = sighting.plane
        predicted, before, after = (
            self._blind.angles(captured + since)[:, plane] for since in (0.0, -self._period / 2.0, self._period / 2.0)
        )
        rate = float(after[0] - before[0]) / self._period
        return self._cameras[plane].saw(sighting, captured, predicted, rate, clock)

    def see(self, tick: Tick, last_usable: float) -> dict[str, float]:
        """All residuals of a tick; nan where one is not known yet."""
        self._began = tick.clock if self._began is None else self._began
        since, one = tick.clock - self._began, len(self._cameras) == 1
        self._count(tick)
        finite = bool(np.isfinite(np.hstack(tick.estimate)).all())
        heard = tick.unheard < _UNHEARD * self._period  # else the wrist goes on, and nobody knows where spools stand
        self._values = {
            "late": tick.late,
            "lapses": float(len(self._lapsed.values(tick.clock))),
            "no_number": float((~np.isfinite(np.hstack(tick.estimate))).sum()),
            "angle": _size(tick.estimate.theta),
            "rate": _size(tick.estimate.rate),
            "age": tick.clock - last_usable,
            "pull": self._pull(tick.position, tick.taut) if finite and heard else math.nan,
            **self._weighed(tick.clock, tick.position, tick.taut),
            "tension_ratio": self._tension_ratio(tick) if finite else math.nan,
            "travel": float(np.abs(tick.position).max()) * self._spools.step,
            "disabled": float(tick.state != State.ENABLED),
            "doubted": self._cameras[0].doubted(tick.clock, since) if one else math.nan,
            **self._following(tick),
            **self._of_timing(tick.clock),
            "unseen": max(each.unseen(tick.clock, since, self._settings.sensor) for each in self._cameras),
            "repeated": float(max(camera.repeated(tick.clock) for camera in self._cameras)),
            "resent": sum(self._resent.values(tick.clock)),
            "moved": max(camera.moved for camera in self._cameras),
            "lag": _largest([camera.lag.least() for camera in self._cameras]),
        }
        self.most = worst(self._values, self.most)
        return self._values

    def judge(self, tick: Tick) -> None:
        """Raises SafetyStop where a residual of the tick last seen is beyond its limit for long enough."""
        beyond = self._judge.beyond(tick.clock, self._values)
        if beyond is not None:
            raise self._stop(beyond, tick)

    def _pull(self, position: Array, taut: Array) -> float:
        return max(0.0, float(self._spools.tension(position, taut).max()))

    def _weighed(self, clock: float, position: Array, taut: Array) -> dict[str, float]:
        stretch = self._spools.step * position - taut
        return {} if self._pulls is None else self._pulls.residuals(clock, stretch)

    def _tension_ratio(self, tick: Tick) -> float:
        """Measured tension over that by spools and estimated bend, of all that should pull by more than little."""
        if tick.tension is None:
            return math.nan
        modelled = self._spools.tension(tick.position, tick.taut)
        pulled = (modelled > self._settings.safety.missing_pull) & np.isfinite(tick.tension)
        return float(tick.tension[pulled].sum() / modelled[pulled].sum()) if pulled.any() else math.nan

    def standing(self, theta: Array, position: Array, taut: Array, clock: float) -> None:
        """Raises SafetyStop where a wrist whose motors stand is bent, or its tendons are pulled, beyond the limits.

        `theta` is its bend (P,).
        """
        values = {"angle": _size(theta), "pull": self._pull(position, taut), **self._weighed(clock, position, taut)}
        for limit in self.limits:
            value = values.get(limit.name, 0.0)
            if abs(value) > limit.limit:
                problem, fix = self._told(limit, value)
                raise SafetyStop(problem, fix=fix)

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
        load = _size(tick.estimate.load)
        frames = tuple(camera.frame for camera in self._cameras if camera.frame is not None)
        if len(frames) < len(self._cameras):
            return dict.fromkeys(_FOLLOWING, math.nan) | {"load": load}
        self._past.append(_Past(tick.clock, frames, tick.position))
        self._positions.append(tick.position)
        while tick.clock - self._past[0].clock > _HISTORY:
            self._past.popleft()
        jumps = [jump_between(self._before(k), frame) for k, frame in enumerate(frames)]
        across = frames[0].away if len(frames) == 1 else math.nan
        return {"jump": _size(jumps), "across": across, "load": load, "apart": _size([each.apart for each in frames])}

    def _before(self, camera: int) -> Frame:
        """The frame of a camera before its newest one; without one before it that one itself."""
        frames = (past.frames[camera] for past in reversed(self._past))
        newest = next(frames)
        return next((frame for frame in frames if frame.captured < newest.captured), newest)

    def _of_timing(self, clock: float) -> dict[str, float]:
        trips, skipped = self._trips.values(clock), sum(self._skipped.values(clock))
        if self._began is None or clock - self._began < _TICKS or not trips:
            return {"round_trip": math.nan, "skipped": math.nan}
        return {"round_trip": float(np.median(trips)), "skipped": skipped / (skipped + len(trips))}

    def _stop(self, limit: Limit, tick: Tick) -> SafetyStop:
        name = limit.name
        problem, fix = self._told(limit, self._values[name])
        if name == "age":
            why, fix = self._timing.camera.missing(tick.clock, limit.limit)
            problem += f" ({why})"
        elif name == "disabled":
            problem = f"the board is {tick.state.name}, not ENABLED"
        elif name in ("late", "skipped") and tick.slow:
            problem, fix = f"{problem}: {tick.slow}", SLOW_CALL
        elif name == "skipped":
            blamed = Counter(who for who in self._blamed.values(tick.clock) if math.isfinite(who))
            culprit = list(FIX)[int(blamed.most_common(1)[0][0])]
            problem, fix = f"{problem}: {culprit}", FIX[culprit]
        elif name in _FOLLOWING or (name == "pull" and self._settings.planes == 2):
            fix = self._words.stopped
            problem = f"{problem}; likely {', or '.join(self._causes(tick)[:4])}"
        return SafetyStop(problem, fix=fix)

    def _told(self, limit: Limit, value: float) -> tuple[str, str]:
        """What stops the motors, and what to do about it; load cells tell which tendons have part in it."""
        problem, line = stopped_by(limit, value, self._own), residual(limit.name, self._own)
        if self._pulls is None or not line.weighed:
            return problem, line.causes
        return f"{problem}; likely {self._pulls.causes(limit.name)}", self._pulls.fix(limit.name)

    def _causes(self, tick: Tick) -> list[str]:
        if not self._past:
            return [residual("load", self._own).causes]
        first, last = self._past[0], self._past[-1]
        jumps = [
            max((abs(jump_between(one.frames[k], two.frames[k])) for one, two in pairwise(self._past)), default=0.0)
            for k in range(len(last.frames))
        ]
        ends = list(zip(first.frames, last.frames, strict=True))
        across = last.frames[0].away if len(ends) == 1 and math.isfinite(last.frames[0].away) else 0.0
        return likely_causes(
            Evidence(
                turned=last.position - first.position,
                torque=self._radius * np.maximum(0.0, self._spools.tension(tick.position, tick.taut)),
                load=np.atleast_1d(tick.estimate.load) @ self._seen_in,
                apart=np.array([frame.apart for frame in last.frames]) @ self._seen_in,
                across=across * self._away,
                bent=np.array([two.seen - one.seen for one, two in ends]) @ self._seen_in,
                meant=np.array([(two.predicted - one.predicted)[0] for one, two in ends]) @ self._seen_in,
                jump=np.array(jumps),
                directions=pull_directions() if self._layout is None else self._layout.directions,
                words=self._words,
                bends=math.radians(self._settings.safety.across_deg),
                oblique=self._oblique,
                reversals=reversals(np.array(self._positions)),
                pushed=self._pushed,
            )
        )


def _size(value: Any) -> float:
    """The value of one plane as it is, or the norm over two."""
    parts = np.atleast_1d(value).tolist()
    return float(parts[0]) if len(parts) == 1 else math.hypot(*parts)


def _largest(values: Sequence[float]) -> float:
    return max((value for value in values if not math.isnan(value)), default=math.nan)
