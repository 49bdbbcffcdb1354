"""Testbeds of trials: the emulated bench in virtual or in real time, or a real board and camera with an operator."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.real_time_bench import RealTimeBench, connect
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.transport import Transport, open_transport
from wristctl.config.hw_run import RigSettings
from wristctl.config.plant import Disturbances, Push
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy
from wristctl.trial.supervised_wait import Meanwhile
from wristctl.trial.tracking import InlineTracking, Kept, PairedTracking, ThreadedTracking, Tracking
from wristctl.vision.camera import Camera, CameraError
from wristctl.vision.device_camera import DeviceCamera
from wristctl.vision.marker import Tracker
from wristctl.vision.view import View

# Tells the operator what to do, and returns once it is done; has moments pass meanwhile, and raises what they raise.
#
# Raises UserError where the operator declines.
Ask = Callable[[str, Meanwhile], None]


BEFORE_MOTION = (
    "The motors will now move. Emergency stop within reach, nobody's hands in the tendons, wrist straight, tendons "
    "slack, both markers in the camera's picture; and do the drives' switches let a motor pull {:g} N at most "
    "(safety.motor_pull; documentation: The rig)?"
)


class Testbed(Protocol):
    """Board and camera with the wrist before them."""

    emulated: bool
    transport: Transport

    def confirm(self, meanwhile: Meanwhile) -> None:
        """Have a person agree to the first motion. Raises UserError, and what `meanwhile` raises."""

    def tracking(self) -> Tracking:
        """The camera, or both, with fresh trackers."""

    def face(self, direction: str, meanwhile: Meanwhile) -> None:
        """Have the wrist turned so that this direction's plane is the one that bends and is seen.

        Of a wrist that bends in two planes nothing is asked.
        """

    def begin(self, start: float, disturbances: Disturbances, noise: Entropy) -> None:
        """A trial's motion starts at `start` on the transport's clock; what is drawn of it comes from this stream."""

    def truth(self, since: float) -> Array:
        """Rows (time since then, coordinates, the last disc's bend or bends, pulls) of an emulated wrist; none of a
        real one."""

    def close(self) -> None:
        """Give everything back."""


def _tracking(
    make: Callable[[Camera, Tracker], InlineTracking | ThreadedTracking], cameras: Sequence[Camera],
    settings: RigSettings, views: Sequence[View],
) -> Tracking:  # fmt: skip
    """Cameras in the order of their planes, each with a fresh tracker."""
    if settings.planes == 1:
        return make(cameras[0], Tracker(settings.markers, views[0], settings.gates))
    first = Tracker(settings.markers, views[0], settings.gates, plane=0)
    second = Tracker(settings.markers_2, views[1], settings.gates, plane=1)
    return PairedTracking([make(camera, tracker) for camera, tracker in zip(cameras, (first, second), strict=True)])


class EmulatedTestbed:
    """The emulated bench; in virtual time it looks when asked, in real time in a thread."""

    emulated = True

    def __init__(
        self, bench: VirtualBench | RealTimeBench, settings: RigSettings, views: Sequence[View], keep: Kept | None
    ) -> None:
        self._bench, self._settings, self._views, self._keep = bench, settings, views, keep
        self.transport: Transport = bench.transport
        self._tracking: Tracking | None = None

    def confirm(self, meanwhile: Meanwhile) -> None:
        """Wait for a while, then agree."""
        self._person(meanwhile)

    def tracking(self) -> Tracking:
        """The rendered camera, or both, with fresh trackers."""
        if self._tracking is not None:
            self._tracking.close()
        kind = ThreadedTracking if isinstance(self._bench, RealTimeBench) else InlineTracking
        cameras = self._settings.bench.camera, self._settings.bench.camera_2
        noisy = all(camera.scene.noise > 0.0 for camera in cameras[: self._settings.planes])
        make = partial(kind, keep=self._keep, now=self.transport.now, noisy=noisy)
        self._tracking = _tracking(make, self._bench.cameras, self._settings, self._views)
        return self._tracking

    def face(self, direction: str, meanwhile: Meanwhile) -> None:
        """Wait for a while, then turn the wrist; in two planes nobody needs to."""
        if self._settings.planes == 1:
            self._person(meanwhile)
            self._bench.face(direction)

    def begin(self, start: float, disturbances: Disturbances, noise: Entropy) -> None:
        """Disturbances and faults count from here."""
        self._bench.begin(start, disturbances, noise)

    def truth(self, since: float) -> Array:
        """True motion of the emulated wrist since then."""
        truth = self._bench.truth(since)
        return np.column_stack([truth.time - since, truth.theta, truth.angle, truth.pull])

    def _person(self, meanwhile: Meanwhile) -> None:
        """The time that a person takes, who bends a held wrist to one side and then to the other."""
        person, clock = self._settings.bench.person, self.transport
        force = person.force if all(self._bench.motion().energised) else 0.0
        for side in (1.0, -1.0):
            begin, half = clock.now(), 0.5 * person.takes
            if force:
                push = Push(force=side * force, start=0.0, duration=half)
                self._bench.disturb(Disturbances(push=push), begin)
            while clock.now() < begin + half:
                meanwhile()

    def close(self) -> None:
        """End the eye and the bench."""
        if self._tracking is not None:
            self._tracking.close()
        self._bench.close()


class RealTestbed:
    """A real board and camera; the operator turns the wrist. Raises PortUnusable and CameraError."""

    emulated = False

    def __init__(self, settings: RigSettings, views: Sequence[View], keep: Kept | None, ask: Ask) -> None:
        self._settings, self._views, self._keep, self._ask = settings, views, keep, ask
        sources = (settings.camera, settings.camera_2)[: settings.planes]
        if len(set(sources)) < settings.planes:
            problem = f"camera 1 and camera 2 are the same, {settings.camera}"
            raise CameraError(problem, "camera_2", "--set camera_2=NUMBER of the camera at a right angle to the first")
        self.transport: Transport = open_transport(settings.port, settings.baud)
        self._cameras: list[DeviceCamera] = []
        try:
            for number, source in enumerate(sources, 1):
                try:
                    self._cameras.append(DeviceCamera(source, settings.device))
                except CameraError as error:
                    if settings.planes == 1:
                        raise
                    raise error.of(number) from error
        except BaseException:
            self._close_devices()
            raise
        self._tracking: Tracking | None = None

    def confirm(self, meanwhile: Meanwhile) -> None:
        """Ask."""
        self._ask(BEFORE_MOTION.format(self._settings.safety.motor_pull), meanwhile)

    def tracking(self) -> Tracking:
        """The camera, or both, with fresh trackers."""
        if self._tracking is not None:
            self._tracking.close()
        make = partial(ThreadedTracking, keep=self._keep)
        self._tracking = _tracking(make, self._cameras, self._settings, self._views)
        return self._tracking

    def face(self, direction: str, meanwhile: Meanwhile) -> None:
        """Ask the operator to turn the wrist; in two planes nobody needs to."""
        if self._settings.planes == 2:
            return
        request = f"Set the wrist up so that it bends toward {direction} in the camera's picture, both markers in view."
        self._ask(request, meanwhile)

    def begin(self, start: float, disturbances: Disturbances, noise: Entropy) -> None:
        """Nobody disturbs a real wrist but a person."""

    def truth(self, since: float) -> Array:
        """Nobody knows."""
        return np.empty((0, 0))

    def close(self) -> None:
        """Give back cameras and port."""
        if self._tracking is not None:
            self._tracking.close()
        self._close_devices()

    def _close_devices(self) -> None:
        for camera in self._cameras:
            camera.close()
        self.transport.close()


def open_testbed(
    settings: RigSettings, wrist: WristParameters, seed: int, view: View, ask: Ask, keep: Kept | None = None,
    view_2: View | None = None,
) -> EmulatedTestbed | RealTestbed:  # fmt: skip
    """The stand of these settings, with the views of its cameras. Raises BoardError and CameraError.

    `keep` takes what both cameras see; of a real rig, or in real time, each calls it from a thread of its own.
    """
    views = view, view_2 or View()
    if settings.port is not None:
        return RealTestbed(settings, views, keep, ask)
    build = connect if settings.real_time else VirtualBench
    markers_2 = settings.markers_2 if settings.planes == 2 else None
    return EmulatedTestbed(build(settings.bench, wrist, seed, settings.markers, markers_2), settings, views, keep)
