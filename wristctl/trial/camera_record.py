"""What one camera has shown of a loop: its usable frames against the model's, and what may be wrong with it."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Sensor
from wristctl.vision.marker import Sighting, SightingVerdict

# Frames at rest at zero by whose median the bend across is none.
_REFERENCE_FRAMES = 5
# Seconds between two frames from which the wrist may have gone anywhere.
_SUCCESSIVE = 0.06
# Seconds that are summed up: of repeated pictures and of doubtful ones, and of usable angles.
_EVENTS, _SEEN = 1.0, 2.0
# Rate at which a wrist may bend across [rad/s]: where a tendon of 30 deg of bend comes off its pulley it is 0.7.
_FASTEST = 1.0
# Share of a second's pictures that may be doubtful.
_SOUND = 0.1
# Seconds after such a change in which a picture is doubtful.
_AFTER = 0.5
# Share by which the grey level may change before the sizes of markers are that of the light.
_LIGHT = 0.1
# Frames from which a lag is told, and its standard errors that are taken off.
_LEAST_FRAMES, _SURE = 20, 3.0


class Frame(NamedTuple):
    """A usable frame, against what spools should have made of the wrist at its capture; SI units."""

    captured: float
    seen: float
    predicted: Array
    """Angles with tendons as believed and as soft as may be, without a declared load and with it, (2,) or (4,)."""
    away: float
    """Bend away from the camera, by the size of the tip's marker; nan where a picture does not tell."""

    @property
    def apart(self) -> float:
        """Angle off what lies between all predictions [rad]."""
        return self.seen - float(np.clip(self.seen, self.predicted.min(), self.predicted.max()))


class _Look(NamedTuple):
    """How a picture shows the markers."""

    time: float
    away: float
    grey: float


class Recent:
    """Values of the last so many seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._values = seconds, deque[tuple[float, float]]()

    def add(self, clock: float, value: float = 1.0) -> None:
        """Take in one."""
        self._values.append((clock, value))

    def values(self, clock: float) -> list[float]:
        """Those that are not too old."""
        while self._values and clock - self._values[0][0] >= self._seconds:
            self._values.popleft()
        return [value for _, value in self._values]


class MarkerLag:
    """Lag of the marker in a motion's usable frames behind the angle that the spools should have made.

    Of theta = a + b (predicted - lag rate) by least squares, less three standard errors.
    """

    def __init__(self) -> None:
        self._count, self._squares = 0, 0.0
        self._normal, self._moments = np.zeros((3, 3)), np.zeros(3)
        self._least: float | None = None

    def add(self, theta: float, predicted: float, rate: float) -> None:
        """Take in the marker's angle, the predicted one [rad] and its rate [rad/s]."""
        terms = np.array([1.0, predicted, -rate])
        self._count, self._squares, self._least = self._count + 1, self._squares + theta * theta, None
        self._normal += np.outer(terms, terms)
        self._moments += theta * terms

    def least(self) -> float:
        """The lag [s] that there is at least; nan where the motion cannot tell."""
        if self._least is None:
            self._least = self._fitted()
        return self._least

    def _fitted(self) -> float:
        scale = np.sqrt(self._normal.diagonal())
        if self._count < _LEAST_FRAMES or not scale.all():
            return math.nan
        alike = self._normal / np.outer(scale, scale)
        if np.linalg.eigvalsh(alike)[0] < 1e-9:
            return math.nan
        inverse = np.linalg.inv(alike) / np.outer(scale, scale)
        coefficients = inverse @ self._moments
        _, share, late = coefficients
        if share <= 0.0:
            return math.nan
        left = max(0.0, self._squares - float(coefficients @ self._moments))
        variance = left / (self._count - 3) * inverse[2, 2]
        return float((late - _SURE * math.sqrt(variance)) / share)


class CameraRecord:
    """One camera's frames since the loop began, with the wrist at rest at zero: the marker's size then is that of no
    bend across. `nearer` is that bend [rad] for a relative change of the size; nan: the size tells nothing.

    A picture is doubtful, and tells no bend across, where the base's marker, which stands, is not seen or changes its
    size by as much as a bend of `doubtful` [rad] would, where the light changes, or for a while after the size has
    changed as fast as no wrist bends. After more than a few of them the size counts from where it then is.
    """

    def __init__(self, nearer: float, doubtful: float = math.inf) -> None:
        self._nearer, self._straight = nearer, list[_Look]()
        self._doubtful, self._doubts = doubtful, Recent(_EVENTS)
        self._before: _Look | None = None
        self._jumped, self._off = -math.inf, 0.0
        self._base: Array | None = None
        self._repeated, self._usable = Recent(_EVENTS), Recent(_SEEN)
        self.lag = MarkerLag()
        """Of the marker in the present motion."""
        self.frame: Frame | None = None
        """The newest usable one."""
        self.moved = 0.0
        """Way of the base's marker from its first place, over its side."""

    def sighted(self, sighting: Sighting, clock: float) -> None:
        """Take in any picture."""
        if sighting.verdict in (SightingVerdict.FROZEN, SightingVerdict.STAMP):
            self._repeated.add(clock)
        base = sighting.corners[0]
        if not np.isfinite(base).all():
            return
        self._base = base if self._base is None else self._base
        side = math.dist(*self._base[:2])
        self.moved = float(np.hypot(*(base - self._base).mean(axis=0))) / side if side > 0.0 else 0.0

    def saw(self, sighting: Sighting, captured: float, predicted: Array, rate: float, clock: float) -> Frame:
        """Take in a usable frame, taken `captured` seconds after tick 0, where the models are at `predicted`, with the
        believed one's rate."""
        self.frame = Frame(sighting.time, sighting.theta, predicted, self._across(sighting, clock))
        self._usable.add(clock)
        self.lag.add(sighting.theta, float(predicted[0]), rate)
        return self.frame

    def _across(self, sighting: Sighting, clock: float) -> float:
        """The bend across [rad]; nan where it is not known or the picture is doubtful."""
        # a marker at a bend b is b L/2 further off
        look = _Look(sighting.time, -self._nearer * math.log(sighting.size), sighting.grey)
        if math.isfinite(look.away) and len(self._straight) < _REFERENCE_FRAMES:
            self._straight.append(look)
        if len(self._straight) < _REFERENCE_FRAMES:
            return math.nan
        _, away, grey = np.median(self._straight, axis=0)
        if self._jumps(look):
            self._jumped = clock
        doubted = (
            clock - self._jumped < _AFTER
            or not self._nearer * abs(math.log(sighting.stands)) <= self._doubtful
            or not abs(look.grey - grey) <= _LIGHT * grey
        )
        self._doubts.add(clock, float(doubted))
        if np.mean(self._doubts.values(clock)) > _SOUND:  # whatever the picture makes of it: from here on it counts
            self._off = look.away - float(away)
        return math.nan if doubted else look.away - float(away) - self._off

    def _jumps(self, look: _Look) -> bool:
        """Whether the size has changed since the picture before as no wrist's does."""
        before, self._before = self._before or look, look
        step, time = look.away - before.away, look.time - before.time
        return time <= _SUCCESSIVE and abs(step) > self._doubtful + _FASTEST * time

    def doubted(self, clock: float, since: float) -> float:
        """Share of the last second's usable pictures that were doubtful, `since` seconds after the loop began."""
        doubts = self._doubts.values(clock)
        return float(np.mean(doubts)) if doubts and since > _EVENTS else math.nan

    def repeated(self, clock: float) -> int:
        """Number of pictures in the last second that were no news."""
        return len(self._repeated.values(clock))

    def unseen(self, clock: float, since: float, sensor: Sensor) -> float:
        """Share of the expected usable angles that did not come, `since` seconds after the loop began; nan at first.

        None are missing where more come than are expected.
        """
        usable = len(self._usable.values(clock))
        expected = min(since, _SEEN) * sensor.frame_rate * (1.0 - sensor.dropped)
        return max(0.0, 1.0 - (usable + 1.0) / expected) if since > 0.5 * _SEEN else math.nan


def jump_between(one: Frame, two: Frame) -> float:
    """Jump of a second frame off the motion that the spools should have made since the first; the least of both."""
    if not 0.0 < two.captured - one.captured <= _SUCCESSIVE:
        return 0.0
    jumps = two.seen - one.seen - (two.predicted - one.predicted)
    return float(jumps[np.abs(jumps).argmin()])
