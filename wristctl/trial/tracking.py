"""The camera's and the tracker's side of the loop: marker angles as they come."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

from wristctl.loop_priority import beside_the_loop
from wristctl.trial.camera_truth import CameraTruth
from wristctl.vision.camera import Camera, Frame
from wristctl.vision.marker import Sighting, Tracker

Kept = Callable[[Frame, Sighting], None]
"""Takes a frame and what was seen in it, to keep it."""


class Tracking(Protocol):
    """Gives sightings to the loop."""

    zero: float
    """Marker angle of the straight wrist [rad], taken off every angle."""

    def look(self) -> list[Sighting]:
        """What was seen since the last look, oldest first; never waits for a frame."""

    def close(self) -> None:
        """Look no more; the camera stays open."""


class InlineTracking:
    """Looks when asked: in virtual time, where looking takes none. `now` is the clock of the camera's times."""

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._camera, self._tracker, self._keep, self._now = camera, tracker, keep, now
        self._truth = CameraTruth()
        self.frame: Frame | None = None
        """The newest."""
        self.zero = 0.0

    def look(self) -> list[Sighting]:
        """The newest frame's sighting, if there is one."""
        frame = self._camera.newest()
        if frame is None:
            return []
        came = self._now()
        seen = self._truth.judge(frame, self._tracker.see(frame)._replace(came=came))
        self.frame, seen = frame, seen._replace(theta=seen.theta - self.zero)
        if self._keep is not None:
            self._keep(frame, seen)
        return [seen]

    def close(self) -> None:
        """Nothing goes on between looks."""


class ThreadedTracking:
    """Looks in a thread of its own, so that the loop waits neither for the camera nor for the tracker.

    A frame is kept once the loop can have its angle: drawing and encoding it takes milliseconds.
    """

    def __init__(
        self, camera: Camera, tracker: Tracker, keep: Kept | None = None, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._inner, self._keep = InlineTracking(camera, tracker, now=now), keep
        self.zero = 0.0
        self._seen: deque[Sighting] = deque(maxlen=64)
        self._error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="eye", daemon=True)
        self._thread.start()

    def look(self) -> list[Sighting]:
        """What was seen since the last look. Raises what ended the thread."""
        if self._error is not None:
            raise self._error
        found = []
        while self._seen:
            found.append(self._seen.popleft())
        return [each._replace(theta=each.theta - self.zero) for each in found]

    def close(self) -> None:
        """Stop looking."""
        self._stop.set()
        self._thread.join(timeout=2.0)

    def _watch(self) -> None:
        try:
            beside_the_loop()
            while not self._stop.is_set():
                if found := self._inner.look():
                    self._seen.extend(found)
                    if self._keep is not None and self._inner.frame is not None:
                        self._keep(self._inner.frame, found[0]._replace(theta=found[0].theta - self.zero))
                else:
                    time.sleep(1e-3)
        except BaseException as error:  # handed to the loop, which stops the motors
            self._error = error
