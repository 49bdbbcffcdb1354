"""Whether the wrist does what the motors do: limits on what the model of both does not explain."""

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import RigSettings
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import rows_of
from wristctl.simulation.actuator import drive_of
from wristctl.simulation.observer import predict
from wristctl.simulation.stationary_filter import Belief, observer_of
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side
from wristctl.vision.marker import Sighting
from wristctl.wrist.directions import ACTIVE, away_of
from wristctl.wrist.segments import load_segments, segments

# Steps in the time looked at from which a motor has turned.
_TURNED = 40.0
# Bend in that time from which the wrist was meant to move.
_MEANT = math.radians(2.0)
# Turnings back, in the time looked at for them, from which a loop swings: a motion there and back has one.
_SWINGS = 3
_LOOP_SWINGS = "the loop swings: friction in the sheaths, a camera later than is believed, or gains too high for them"
# Change from one frame to the next that no motion at rest makes.
_JUMP = math.radians(2.0)


class Evidence(NamedTuple):
    """Evidence of the last moments; SI units."""

    turned: Array
    """Steps by which each spool was told to reel in, (4,)."""
    load: float
    across: float
    """Away from the camera."""
    bent: float
    meant: float
    """Bend of the wrist that its spools should have made; `bent` is the measured one."""
    jump: float
    """Largest change of the marker's angle from one frame to the next, off what the spools make."""
    bends: float
    """Bend across that is beyond the limit."""
    reversals: int = 0
    """Number of times that a spool has turned back."""


def reversals(positions: Array) -> int:
    """Largest number of times that a spool of (n, 4) [steps] has turned back, by enough to count as turned."""
    return max(_turned_back(course) for course in positions.T.tolist())


def _turned_back(course: Sequence[float]) -> int:
    turns, sense, low, high = 0, 0, course[0], course[0]
    for position in course:
        low, high = min(low, position), max(high, position)
        if sense >= 0 and high - position >= _TURNED:
            turns, sense, low = turns + sense, -1, position
        elif sense <= 0 and position - low >= _TURNED:
            turns, sense, high = turns - sense, 1, position
    return turns


def likely_causes(evidence: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    """Causes in words.

    A load toward one side means that a tendon of the other pulls less than its spool says, or one of the same side
    more. Of each pair the bend across tells which: it is away from a camera for a tendon that pulls too much on the
    far side, or too little on the near one.
    """
    swings = [_LOOP_SWINGS] if evidence.reversals >= _SWINGS else []
    if abs(evidence.across) > 0.5 * evidence.bends and evidence.jump <= _JUMP:
        return [*swings, *_of_one_tendon(evidence, plus, away)]
    causes, meant = swings, abs(evidence.meant) > _MEANT
    if evidence.jump > _JUMP:
        causes += ["the tip's marker has slipped on its disc", "the camera shows or dates pictures wrongly"]
    share = evidence.bent / evidence.meant if meant else math.nan
    if abs(share) < 0.15:
        causes.append("the motors have no supply")
    if share < 0.15:
        causes.append("both motors of a side turn the wrong way, are stuck, or are exchanged with the other side's")
    turning = bool((abs(evidence.turned) > _TURNED).any())
    if meant and share >= 0.15:
        much = "more" if share > 1.0 else "less"
        causes.append(f"the wrist bends by {much} than its spools say: wrong pulley or microsteps (DIP switches)")
    if turning:
        causes.append("motors exchanged, detached or slipped tendons on a side, or a stalled motor")
    else:
        causes.append("a side's tendons slipped or came off, or the motors' supply was lost")
    if evidence.jump <= _JUMP:
        causes += ["the camera shows old pictures", "the tip's marker has slipped on its disc"]
    return [*dict.fromkeys(causes), "something holds or pushes the wrist"]


def _of_one_tendon(evidence: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    far, toward_plus = evidence.across > 0.0, evidence.load > 0.0
    much = next(k for k in range(4) if plus[k] == toward_plus and (away[k] > 0) == far)
    little = next(k for k in range(4) if plus[k] != toward_plus and (away[k] > 0) != far)
    named = {axis: f"axis {axis} (tendon {ACTIVE[axis]})" for axis in (much, little)}
    causes = []
    if evidence.turned[much] < -_TURNED:
        causes.append(f"{named[much]} turns the wrong way, or its direction is stuck")
    if evidence.turned[little] > _TURNED:
        causes.append(f"{named[little]} turns the wrong way")
    if abs(evidence.turned[much]) > _TURNED or abs(evidence.turned[little]) > _TURNED:
        causes.append("motors exchanged")
    causes.append(f"the tendon of {named[little]} is off its pulley")
    causes.append(f"it has slipped on it, or that of {named[much]} has")
    if abs(evidence.turned[little]) > _TURNED:
        causes.append(f"{named[little]} has stalled or has no power")
    return [*causes, "something pushes the wrist across its plane"]


# Ticks.
_REMEMBERED = 256


class BlindModel:
    """Two one-segment wrists at rest at zero: with tendons as believed, and with the softest that there may be.

    Tendons that are softer than believed bend a wrist less; what is true lies between the two. Ticks are numbered from
    0, `period` [s] apart.
    """

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, softest: float, sensor: Sensor, period: float
    ) -> None:
        soft = actuator.model_copy(update={"tendon_stiffness": min(softest, actuator.tendon_stiffness)})
        self._drives = [drive_of(parameters) for parameters in (actuator, soft)]
        self._observers = [observer_of(Belief(sensor, actuator, wrist, period), 1, 0.0) for _ in self._drives]
        self._model, self._period, self._tick = segments(wrist, 1), period, 0
        self._angles = np.zeros((_REMEMBERED, 2))

    def predict(self, reeled_plus: float, reeled_minus: float) -> None:
        """Go on to the next tick, with the sides reeled in by so much [m] until then."""
        self._tick += 1
        for k, (observer, drive) in enumerate(zip(self._observers, self._drives, strict=True)):
            _predict(observer, drive, self._model, reeled_plus, reeled_minus, self._period)
            self._angles[self._tick % _REMEMBERED, k] = observer.now[0]

    def angles(self, time: float) -> Array:
        """Predicted angles (2,) [rad] `time` seconds after tick 0, as far as they are remembered."""
        tick = min(max(math.floor(time / self._period), self._tick - _REMEMBERED + 1), self._tick)
        share = min(max(time / self._period - tick, 0.0), 1.0)
        before, after = self._angles[tick % _REMEMBERED], self._angles[min(tick + 1, self._tick) % _REMEMBERED]
        between: Array = before + share * (after - before)
        return between


@kernel
def _predict(observer: Any, drive: Any, model: Any, plus: float, minus: float, h: float) -> None:
    believed = load_segments(rows_of(model))
    zero = zero_like(believed.length)
    predict(observer, drive, believed, 0, plus + zero, minus + zero, h)


# Seconds by which causes are judged, and whether the loop swings.
_HISTORY, _SWINGING = 0.2, 1.0
# Seconds between two frames from which the wrist may have gone anywhere.
_SUCCESSIVE = 0.06
# Frames at rest at zero by whose median the bend across is none.
_REFERENCE_FRAMES = 5


class Followed(NamedTuple):
    """Values compared at one tick; SI units, nan where unknown."""

    time: float
    captured: float
    """When the newest usable frame was taken."""
    seen: float
    """Marker angle of that frame."""
    predicted: Array
    """Angles that the spools should have made, with tendons as believed and as soft as may be, (2,)."""
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

    def saw(self, sighting: Sighting, captured: float) -> tuple[float, float]:
        """Take in a usable frame, taken `captured` seconds after tick 0; the angle that tendons as believed should
        have had then, and its rate."""
        away = -self._nearer * math.log(sighting.size)  # a marker at a bend b is b L/2 further off
        predicted = self._blind.angles(captured)
        self._frame = Followed(0.0, sighting.time, sighting.theta, predicted, 0.0, self._across(away), np.zeros(0))
        before, after = (self._blind.angles(captured + half)[0] for half in (-self._period / 2.0, self._period / 2.0))
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
        sizes = Greatest(*(0.0 if math.isnan(value) else abs(value) for value in (apart, jump, load, now.away)))
        self.greatest = Greatest(*map(max, self.greatest, sizes))
        if sizes.jump > math.radians(limits.jump_deg):
            raise self._stop("jump", sizes.jump, math.radians(limits.jump_deg))
        self._judge("across", sizes.across, math.radians(limits.across_deg), now)
        self._judge("load", sizes.load, limits.load, now)
        self._judge("apart", sizes.apart, math.radians(limits.follow_deg), now)

    def _across(self, away: float) -> float:
        if math.isfinite(away) and len(self._straight) < _REFERENCE_FRAMES:
            self._straight.append(away)
        if len(self._straight) < _REFERENCE_FRAMES:
            return math.nan
        return away - float(np.median(self._straight))

    def _judge(self, quantity: str, value: float, limit: float, now: Followed) -> None:
        if value <= limit:
            self._beyond.pop(quantity, None)
            return
        if now.time - self._beyond.setdefault(quantity, now.time) < self._limits.odd_for * limit / value:
            return
        raise self._stop(quantity, value, limit)

    def _stop(self, quantity: str, value: float, limit: float) -> SafetyStop:
        return SafetyStop(f"{self._told(quantity, value, limit)}; likely {', or '.join(self._causes()[:4])}", fix=_FIX)

    def _told(self, quantity: str, value: float, limit: float) -> str:
        if quantity == "load":
            return f"the wrist does not follow its motors: a load of {value:.2f} N m, beyond {limit:g} N m"
        angle, most = (f"{math.degrees(bend):.1f} deg" for bend in (value, limit))
        if quantity == "jump":
            return f"the marker's angle jumps by {angle} from one frame to the next, beyond {most}"
        if quantity == "apart":
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
    """Jump of a second frame off the motion that the spools should have made since the first."""
    if not 0.0 < two.captured - one.captured <= _SUCCESSIVE:
        return 0.0
    return float(np.abs(two.seen - one.seen - (two.predicted - one.predicted)).min())
