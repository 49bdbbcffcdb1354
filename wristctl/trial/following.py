"""Whether the wrist does what the motors do: limits on what the model of both does not explain."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.blind_model import BlindModel
from wristctl.trial.likely_causes import Evidence, likely_causes, reversals
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side
from wristctl.vision.marker import Sighting
from wristctl.wrist.directions import away_of

_HISTORY, _SWINGING = 0.2, 1.0
"""Seconds by which causes are judged, and whether the loop swings."""
_SUCCESSIVE = 0.06
"""Seconds between two frames from which the wrist may have gone anywhere."""
_REFERENCE_FRAMES = 5
"""Frames at rest at zero by whose median the bend across is none."""


class Followed(NamedTuple):
    """What is compared at one tick; SI units, nan where it is not known."""

    time: float
    captured: float
    """When the newest usable frame was taken."""
    seen: float
    """Marker angle of that frame."""
    predicted: Array
    """What the spools should have made of it: with tendons as believed and as soft as may be, (2,)."""
    load: float
    away: float
    """Bend away from the camera, by the size of the tip's marker."""
    position: Array
    """Spools, (4,) [steps]."""


class Greatest(NamedTuple):
    """The largest that has been seen of each limited thing; SI units."""

    apart: float = 0.0
    jump: float = 0.0
    load: float = 0.0
    across: float = 0.0


class Following:
    """Raises SafetyStop, with likely causes, once a limit is exceeded for `safety.odd_for`, or twice for half as long.

    At first the wrist is at rest at zero: what the marker's size is then is that of a wrist not bent across.
    """

    def __init__(self, settings: RigSettings, wrist: WristParameters, plane: str, period: float) -> None:
        self._limits, self._plus = settings.safety, tuple(on_plus_side(plane).tolist())
        self._away = away_of(plane, settings.markers.positive)
        self._blind = BlindModel(wrist, settings.actuator, self._limits.softest, settings.sensor, period)
        self._period = period
        self._nearer = 2.0 * settings.markers.distance / wrist.length
        self._frame: Followed | None = None
        self.greatest = Greatest()
        self._straight: list[float] = []
        self._beyond: dict[str, float] = {}
        self._past: deque[Followed] = deque()
        self._positions: deque[Array] = deque(maxlen=round(_SWINGING / period))

    def predict(self, reeled_plus: float, reeled_minus: float) -> None:
        """Go on to the next tick, with the sides reeled in by so much [m] until then."""
        self._blind.predict(reeled_plus, reeled_minus)

    def saw(self, seen: Sighting, captured: float) -> tuple[float, float]:
        """Take in a usable frame, taken `captured` seconds after tick 0; the angle that tendons as believed should
        have had then, and its rate."""
        away = -self._nearer * math.log(seen.size)  # a marker at a bend b is b L/2 further off
        predicted = self._blind.angles(captured)
        self._frame = Followed(0.0, seen.time, seen.theta, predicted, 0.0, self._across(away), np.zeros(0))
        before, after = (self._blind.angles(captured + each)[0] for each in (-self._period / 2.0, self._period / 2.0))
        return float(predicted[0]), float(after - before) / self._period

    def see(self, time: float, load: float, position: Array) -> None:
        """Judge a tick."""
        if self._frame is None:
            return
        now = self._frame._replace(time=time, load=load, position=position)
        self._past.append(now)
        self._positions.append(position)
        while now.time - self._past[0].time > _HISTORY:
            self._past.popleft()
        limits = self._limits
        apart = now.seen - float(np.clip(now.seen, now.predicted.min(), now.predicted.max()))
        jump = _jump(*list(self._past)[-2:]) if len(self._past) > 1 else 0.0
        known = Greatest(*(0.0 if math.isnan(each) else abs(each) for each in (apart, jump, load, now.away)))
        self.greatest = Greatest(*map(max, self.greatest, known))
        if known.jump > math.radians(limits.jump_deg):
            raise self._stop("jump", known.jump, math.radians(limits.jump_deg))
        self._judge("across", known.across, math.radians(limits.across_deg), now)
        self._judge("load", known.load, limits.load, now)
        self._judge("apart", known.apart, math.radians(limits.follow_deg), now)

    def _across(self, away: float) -> float:
        if math.isfinite(away) and len(self._straight) < _REFERENCE_FRAMES:
            self._straight.append(away)
        if len(self._straight) < _REFERENCE_FRAMES:
            return math.nan
        return away - float(np.median(self._straight))

    def _judge(self, what: str, value: float, limit: float, now: Followed) -> None:
        if value <= limit:
            self._beyond.pop(what, None)
            return
        if now.time - self._beyond.setdefault(what, now.time) < self._limits.odd_for * limit / value:
            return
        raise self._stop(what, value, limit)

    def _stop(self, what: str, value: float, limit: float) -> SafetyStop:
        return SafetyStop(f"{self._told(what, value, limit)}; likely {', or '.join(self._causes()[:4])}", fix=_FIX)

    def _told(self, what: str, value: float, limit: float) -> str:
        if what == "load":
            return f"the wrist does not follow its motors: a load of {value:.2f} N m, beyond {limit:g} N m"
        angle, most = (f"{math.degrees(each):.1f} deg" for each in (value, limit))
        if what == "jump":
            return f"the marker's angle jumps by {angle} from one frame to the next, beyond {most}"
        if what == "apart":
            return f"the wrist does not follow its motors: it is {angle} from where they should have it, beyond {most}"
        return f"the wrist bends {angle} across its plane, beyond {most}"

    def _causes(self) -> list[str]:
        first, last = self._past[0], self._past[-1]
        jump = max((_jump(one, two) for one, two in pairwise(self._past)), default=0.0)
        evidence = Evidence(
            turned=last.position - first.position,
            load=last.load,
            across=0.0 if math.isnan(last.away) else last.away,
            bent=last.seen - first.seen,
            meant=float((last.predicted - first.predicted)[0]),
            jump=jump,
            bends=math.radians(self._limits.across_deg),
            reversals=reversals(np.array(self._positions)),
        )
        return likely_causes(evidence, self._plus, self._away)


_FIX = "cut the motors' supply, slacken the tendons by hand, and look; docs/hardware/faults.md says how each shows"


def _jump(one: Followed, two: Followed) -> float:
    """By how much a second frame came off the motion that the spools should have made since the first."""
    if not 0.0 < two.captured - one.captured <= _SUCCESSIVE:
        return 0.0
    return float(np.abs(two.seen - one.seen - (two.predicted - one.predicted)).min())
