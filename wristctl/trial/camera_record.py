"""What one camera has shown of a loop: its usable frames against the model's, and what may be wrong with it."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Sensor
from wristctl.trial.marker_lag import MarkerLag
from wristctl.vision.marker import Sighting, SightingVerdict

# Frames at rest at zero by whose median the bend across is none.
_REFERENCE_FRAMES = 5
# Seconds between two frames from which the wrist may have gone anywhere.
_SUCCESSIVE = 0.06
# Seconds that are summed up: of repeated pictures, and of usable angles.
_EVENTS, _SEEN = 1.0, 2.0


class Frame(NamedTuple):
    """A usable frame, against what spools should have made of the wrist at its capture; SI units."""

    captured: float
    seen: float
    predicted: Array
    """Angles with tendons as believed and as soft as may be, (2,)."""
    away: float
    """Bend away from the camera, by the size of the tip's marker; nan where it is not known."""

    @property
    def apart(self) -> float:
        """Angle off what lies between both predictions [rad]."""
        return self.seen - float(np.clip(self.seen, self.predicted.min(), self.predicted.max()))


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


class CameraRecord:
    """One camera's frames since the loop began, with the wrist at rest at zero: the marker's size then is that of no
    bend across. `nearer` is that bend [rad] for a relative change of the size; nan: the size tells nothing.
    """

    def __init__(self, nearer: float) -> None:
        self._nearer, self._straight = nearer, list[float]()
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
        """Take in a usable frame, taken `captured` seconds after tick 0, where the model has (2,) and this rate."""
        away = -self._nearer * math.log(sighting.size)  # a marker at a bend b is b L/2 further off
        if math.isfinite(away) and len(self._straight) < _REFERENCE_FRAMES:
            self._straight.append(away)
        known = len(self._straight) == _REFERENCE_FRAMES
        across = away - float(np.median(self._straight)) if known else math.nan
        self.frame = Frame(sighting.time, sighting.theta, predicted, across)
        self._usable.add(clock)
        self.lag.add(sighting.theta, float(predicted[0]), rate)
        return self.frame

    def repeated(self, clock: float) -> int:
        """Number of pictures in the last second that were no news."""
        return len(self._repeated.values(clock))

    def unseen(self, clock: float, since: float, sensor: Sensor) -> float:
        """Share of the expected usable angles that did not come, `since` seconds after the loop began; nan at first."""
        usable = len(self._usable.values(clock))
        expected = min(since, _SEEN) * sensor.frame_rate * (1.0 - sensor.dropped)
        return 1.0 - (usable + 1.0) / expected if since > 0.5 * _SEEN else math.nan


def jump_between(one: Frame, two: Frame) -> float:
    """Jump of a second frame off the motion that the spools should have made since the first; the least of both."""
    if not 0.0 < two.captured - one.captured <= _SUCCESSIVE:
        return 0.0
    jumps = two.seen - one.seen - (two.predicted - one.predicted)
    return float(jumps[np.abs(jumps).argmin()])
