"""The camera's and the tracker's side of the loop: marker angles as they come."""

import math
import threading
import time
import zlib
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.loop_priority import beside_the_loop
from wristctl.trial.camera_pace import CameraPaces
from wristctl.trial.rig_drive import RigTracking
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


class InlineTracking:
    """Looks when asked: in virtual time, where looking takes none. `now` is the clock of the camera's times."""

    pace: CameraPaces | None = None
    """Counts looks in words of its own; None: pictures are."""
    apart = 0.0
    """Seconds between two usable sightings that a reading is waited for, beyond what it is for any."""

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic,
        noisy: bool = True,
    ) -> None:  # fmt: skip
        self._camera, self._tracker, self._keep, self._now = camera, tracker, keep, now
        self._truth = CameraTruth(noisy)
        self.zero: tuple[float, ...] = (0.0,)
        """Marker angle of the straight wrist [rad] as the camera sees it, taken off its every angle."""

    def look(self) -> list[Sighting]:
        """The newest frame's sighting, if there is one; never waits for a frame."""
        seen = self._newest()
        return [] if seen is None else [self._told(*seen)]

    def _newest(self) -> tuple[Frame, Sighting] | None:
        if (frame := self._camera.newest()) is None:
            return None
        came = self._now()
        return frame, self._truth.judge(frame, self._tracker.see(frame)._replace(came=came))

    def _told(self, frame: Frame, sighting: Sighting) -> Sighting:
        """A sighting by its angle from zero, kept with its frame."""
        sighting = sighting._replace(theta=sighting.theta - self.zero[0])
        if self._keep is not None:
            self._keep(frame, sighting)
        return sighting

    def bend(self, sighting: Sighting, other: float) -> float:
        """Bend about the sighting's plane [rad] of a wrist in two planes, where that about the other one is `other`."""
        return bend_seen(sighting, self._tracker.view, other, self.zero[0], self._tracker.side)

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """As `Tracker.stand_square`: the frames to come are seen so, and the marker's zero is to be read anew."""
        return self._tracker.stand_square(sightings)

    def close(self) -> None:
        """Look no more; the camera stays open."""


class ThreadedTracking(InlineTracking):
    """Looks in a thread of its own, so that the loop waits neither for the camera nor for the tracker.

    A frame is kept once the loop can have its angle: drawing and encoding it takes milliseconds.
    """

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic,
        noisy: bool = True,
    ) -> None:  # fmt: skip
        super().__init__(camera, tracker, keep, now, noisy)
        self._seen: deque[Sighting] = deque(maxlen=64)
        self._error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="eye", daemon=True)
        self._thread.start()

    def look(self) -> list[Sighting]:
        """Sightings since the last look, oldest first. Raises the error that ended the thread."""
        if self._error is not None:
            raise self._error
        sightings = []
        while self._seen:
            sightings.append(self._seen.popleft())
        return [sighting._replace(theta=sighting.theta - self.zero[0]) for sighting in sightings]

    def close(self) -> None:
        """Stop looking."""
        self._stop.set()
        self._thread.join(timeout=2.0)

    def _watch(self) -> None:
        try:
            beside_the_loop()
            while not self._stop.is_set():
                if (seen := self._newest()) is None:
                    time.sleep(1e-3)
                    continue
                self._seen.append(seen[1])
                self._told(*seen)
        except BaseException as error:  # handed to the loop, which stops the motors
            self._error = error


class PairedTracking:
    """Both cameras of a wrist in two planes, each with a tracking of its own, in the order of their planes."""

    pace: CameraPaces | None = None
    apart = 0.0

    def __init__(self, trackings: Sequence[InlineTracking]) -> None:
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
        """As `InlineTracking.bend`."""
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


Tracking = InlineTracking | PairedTracking | RigTracking
"""Gives sightings to the loop, of one camera, of both, or of a rig's looks."""


def bend_of(tracking: Tracking, sighting: Sighting, bends: Array) -> float:
    """Bend [rad] of a sighting in its camera's plane, by what is known of the bends (P,) of all.

    A bend in the other plane turns the marker in the picture; of one camera the angle is as it is.
    """
    theta = sighting.theta
    for plane, other in enumerate(bends.tolist()):
        if plane != sighting.plane:
            theta = tracking.bend(sighting, other)
    return theta
