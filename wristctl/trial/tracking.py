"""The camera's and the tracker's side of the loop: marker angles as they come."""

import math
import threading
import time
import zlib
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.loop_priority import beside_the_loop
from wristctl.trial.camera_pace import CameraPaces
from wristctl.vision.camera import Camera, CameraError, Frame
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.marker import Sighting, SightingVerdict, Tracker
from wristctl.vision.two_views import bend_seen

# Seconds for which a picture is known again: longer than any ring of buffers lasts.
_REMEMBERED = 1.0
# Pixels within which corners are the same. Noise moves those of a wrist at rest by ten times as much, all eight of
# them, each in both directions, in every picture; a repeated one gives them to rounding.
_SAME = 1e-3
# Seconds by which a time stamp may be ahead of the clock: both are rounded.
_CLOCKS = 1e-3


class _Known(NamedTuple):
    came: float
    print: int
    corners: Array


class CameraTruth:
    """Judges one picture after the other; what is no news is no angle.

    A picture is known again by all its bytes, or by the corners of its markers, which stay the same where only a pixel
    or a clock in the picture changes. Of a camera that is not `noisy`, as none is but an emulated one, every picture is
    news: a wrist at rest gives the same again, and one that does not move with its motors is found by that.
    """

    def __init__(self, noisy: bool = True) -> None:
        self._noisy = noisy
        self._known: deque[_Known] = deque()
        self._time, self._number = -math.inf, -1

    def judge(self, frame: Frame, sighting: Sighting) -> Sighting:
        """Judge a sighting: unchanged, or of verdict `stamp` or `frozen`; it says when the frame came."""
        while self._known and sighting.came - self._known[0].came > _REMEMBERED:
            self._known.popleft()
        shown = _Known(sighting.came, zlib.crc32(frame.image.tobytes()), sighting.corners)
        repeated = self._noisy and any(_alike(earlier, shown) for earlier in self._known)
        self._known.append(shown)
        stamped = self._time < frame.time <= sighting.came + _CLOCKS and self._number < frame.number
        self._time, self._number = max(self._time, min(frame.time, sighting.came)), max(self._number, frame.number)
        if repeated:
            return sighting._replace(theta=math.nan, verdict=SightingVerdict.FROZEN)
        return sighting if stamped else sighting._replace(theta=math.nan, verdict=SightingVerdict.STAMP)


def _alike(before: _Known, now: _Known) -> bool:
    if before.print == now.print:
        return True
    if not np.isfinite(now.corners[1]).all():
        return False
    moved = np.abs(now.corners - before.corners)
    return bool((moved[1] < _SAME).all() and not (moved[0] >= _SAME).any())


# Takes a frame and what was seen in it, to keep it.
Kept = Callable[[Frame, Sighting], None]


class Tracking(Protocol):
    """Gives sightings to the loop."""

    zero: tuple[float, ...]
    """Marker angle of the straight wrist [rad] as each camera sees it, taken off its every angle."""
    pace: CameraPaces | None
    """Counts looks in words of its own; None: pictures are."""
    apart: float
    """Seconds between two usable sightings that a reading is waited for, beyond what it is for any."""

    def look(self) -> list[Sighting]:
        """Sightings since the last look, oldest first, of one camera or of both; never waits for a frame."""

    def bend(self, sighting: Sighting, other: float) -> float:
        """Bend about the sighting's plane [rad] of a wrist in two planes, where that about the other one is `other`."""

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """Set the bending plane square, for a camera that has not been calibrated: `Tracker.stand_square`.

        Of two cameras it is done for the one that the first sighting is of.
        """

    def close(self) -> None:
        """Look no more; the camera stays open."""


def bend_of(tracking: Tracking, sighting: Sighting, bends: Array) -> float:
    """Bend [rad] of a sighting in its camera's plane, by what is known of the bends (P,) of all.

    A bend in the other plane turns the marker in the picture; of one camera the angle is as it is.
    """
    theta = sighting.theta
    for plane, other in enumerate(bends.tolist()):
        if plane != sighting.plane:
            theta = tracking.bend(sighting, other)
    return theta


class InlineTracking:
    """Looks when asked: in virtual time, where looking takes none. `now` is the clock of the camera's times."""

    pace: CameraPaces | None = None
    apart = 0.0

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic,
        noisy: bool = True,
    ) -> None:  # fmt: skip
        self._camera, self._tracker, self._keep, self._now = camera, tracker, keep, now
        self._truth = CameraTruth(noisy)
        self.frame: Frame | None = None
        """The newest."""
        self.zero: tuple[float, ...] = (0.0,)

    def look(self) -> list[Sighting]:
        """The newest frame's sighting, if there is one."""
        frame = self._camera.newest()
        if frame is None:
            return []
        came = self._now()
        sighting = self._truth.judge(frame, self._tracker.see(frame)._replace(came=came))
        self.frame, sighting = frame, sighting._replace(theta=sighting.theta - self.zero[0])
        if self._keep is not None:
            self._keep(frame, sighting)
        return [sighting]

    def bend(self, sighting: Sighting, other: float) -> float:
        """As `Tracking.bend`."""
        return self.bend_with_zero(sighting, other, self.zero[0])

    def bend_with_zero(self, sighting: Sighting, other: float, zero: float) -> float:
        """The same where this zero has been taken off the sighting's angle [rad]."""
        return bend_seen(sighting, self._tracker.view, other, zero, self._tracker.side)

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """The frames to come are seen so; the marker's zero is to be read anew."""
        return self._tracker.stand_square(sightings)

    def close(self) -> None:
        """Nothing goes on between looks."""


class ThreadedTracking:
    """Looks in a thread of its own, so that the loop waits neither for the camera nor for the tracker.

    A frame is kept once the loop can have its angle: drawing and encoding it takes milliseconds.
    """

    pace: CameraPaces | None = None
    apart = 0.0

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic,
        noisy: bool = True,
    ) -> None:  # fmt: skip
        self._inner, self._keep = InlineTracking(camera, tracker, now=now, noisy=noisy), keep
        self.zero: tuple[float, ...] = (0.0,)
        self._seen: deque[Sighting] = deque(maxlen=64)
        self._error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="eye", daemon=True)
        self._thread.start()

    def look(self) -> list[Sighting]:
        """Sightings since the last look. Raises the error that ended the thread."""
        if self._error is not None:
            raise self._error
        sightings = []
        while self._seen:
            sightings.append(self._seen.popleft())
        return [sighting._replace(theta=sighting.theta - self.zero[0]) for sighting in sightings]

    def bend(self, sighting: Sighting, other: float) -> float:
        """As `Tracking.bend`."""
        return self._inner.bend_with_zero(sighting, other, self.zero[0])

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """The frames to come are seen so; the marker's zero is to be read anew."""
        return self._inner.stand_square(sightings)

    def close(self) -> None:
        """Stop looking."""
        self._stop.set()
        self._thread.join(timeout=2.0)

    def _watch(self) -> None:
        try:
            beside_the_loop()
            while not self._stop.is_set():
                if sightings := self._inner.look():
                    self._seen.extend(sightings)
                    if self._keep is not None and self._inner.frame is not None:
                        self._keep(self._inner.frame, sightings[0]._replace(theta=sightings[0].theta - self.zero[0]))
                else:
                    time.sleep(1e-3)
        except BaseException as error:  # handed to the loop, which stops the motors
            self._error = error


class PairedTracking:
    """Both cameras of a wrist in two planes, each with a tracking of its own, in the order of their planes."""

    pace: CameraPaces | None = None
    apart = 0.0

    def __init__(self, trackings: Sequence[InlineTracking | ThreadedTracking]) -> None:
        self._trackings = tuple(trackings)

    @property
    def zero(self) -> tuple[float, ...]:
        """Marker angle of the straight wrist as each camera sees it [rad]."""
        return tuple(tracking.zero[0] for tracking in self._trackings)

    @zero.setter
    def zero(self, angles: tuple[float, ...]) -> None:
        """Take these angles, one for each camera [rad]."""
        for tracking, angle in zip(self._trackings, angles, strict=True):
            tracking.zero = (angle,)

    def look(self) -> list[Sighting]:
        """Both cameras' sightings, by the time of capture. Raises the error that ended a camera's thread."""
        sightings = list[Sighting]()
        for number, tracking in enumerate(self._trackings, 1):
            try:
                sightings += tracking.look()
            except CameraError as error:
                raise error.of(number) from error
        return sorted(sightings, key=lambda sighting: sighting.time)

    def bend(self, sighting: Sighting, other: float) -> float:
        """As `Tracking.bend`."""
        return self._trackings[sighting.plane].bend(sighting, other)

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """As `Tracking.stand_square`, of the camera that the first of these sightings is of, by its own alone."""
        if not sightings:
            return None
        plane = sightings[0].plane
        return self._trackings[plane].stand_square([sighting for sighting in sightings if sighting.plane == plane])

    def close(self) -> None:
        """Stop looking."""
        for tracking in self._trackings:
            tracking.close()
