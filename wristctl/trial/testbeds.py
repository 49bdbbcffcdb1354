"""Testbeds of trials: the emulated bench in virtual or in real time, or a real board and camera with an operator."""

from collections.abc import Callable, Sequence

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


class _Testbed:
    """Board and cameras with the wrist before them."""

    emulated: bool
    transport: Transport

    def __init__(self, settings: RigSettings, views: Sequence[View], cameras: Sequence[Camera]) -> None:
        self._settings, self._views, self._cameras = settings, views, cameras
        self._tracking: Tracking | None = None

    def _watched(self, camera: Camera, tracker: Tracker) -> InlineTracking:
        raise NotImplementedError

    def tracking(self) -> Tracking:
        """The camera, or both in the order of their planes, with fresh trackers."""
        if self._tracking is not None:
            self._tracking.close()
        settings = self._settings
        if settings.planes == 1:
            self._tracking = self._watched(self._cameras[0], Tracker(settings.markers, self._views[0], settings.gates))
            return self._tracking
        first = Tracker(settings.markers, self._views[0], settings.gates, plane=0)
        second = Tracker(settings.markers_2, self._views[1], settings.gates, plane=1)
        both = zip(self._cameras, (first, second), strict=True)
        self._tracking = PairedTracking([self._watched(camera, tracker) for camera, tracker in both])
        return self._tracking

    def close(self) -> None:
        """Give everything back."""
        if self._tracking is not None:
            self._tracking.close()


class EmulatedTestbed(_Testbed):
    """The emulated bench; in virtual time it looks when asked, in real time in a thread."""

    emulated = True

    def __init__(
        self, bench: VirtualBench | RealTimeBench, settings: RigSettings, views: Sequence[View], keep: Kept | None
    ) -> None:
        super().__init__(settings, views, bench.cameras)
        self._bench, self._keep = bench, keep
        self.transport = bench.transport

    def confirm(self, meanwhile: Meanwhile) -> None:
        """Wait for a while, then agree."""
        self._person(meanwhile)

    def _watched(self, camera: Camera, tracker: Tracker) -> InlineTracking:
        kind = ThreadedTracking if isinstance(self._bench, RealTimeBench) else InlineTracking
        cameras = self._settings.bench.camera, self._settings.bench.camera_2
        noisy = all(camera.scene.noise > 0.0 for camera in cameras[: self._settings.planes])
        return kind(camera, tracker, self._keep, self.transport.now, noisy)

    def face(self, direction: str, meanwhile: Meanwhile) -> None:
        """Wait for a while, then turn the wrist to this direction's plane; in two planes nobody needs to."""
        if self._settings.planes == 1:
            self._person(meanwhile)
            self._bench.face(direction)

    def begin(self, start: float, disturbances: Disturbances, noise: Entropy) -> None:
        """A trial's motion starts at `start` on the transport's clock: disturbances, faults and noise count from it."""
        self._bench.begin(start, disturbances, noise)

    def truth(self, since: float) -> Array:
        """Rows (time since then, coordinates, the last disc's bend or bends, pulls) of the emulated wrist."""
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
        super().close()
        self._bench.close()


class RealTestbed(_Testbed):
    """A real board and camera; the operator turns the wrist. Raises PortUnusable and CameraError."""

    emulated = False

    def __init__(self, settings: RigSettings, views: Sequence[View], keep: Kept | None, ask: Ask) -> None:
        self._devices: list[DeviceCamera] = []
        super().__init__(settings, views, self._devices)
        self._keep, self._ask = keep, ask
        sources = (settings.camera, settings.camera_2)[: settings.planes]
        if len(set(sources)) < settings.planes:
            problem = f"camera 1 and camera 2 are the same, {settings.camera}"
            raise CameraError(problem, "camera_2", "--set camera_2=NUMBER of the camera at a right angle to the first")
        self.transport = open_transport(settings.port, settings.baud)
        try:
            for number, source in enumerate(sources, 1):
                try:
                    self._devices.append(DeviceCamera(source, settings.device))
                except CameraError as error:
                    if settings.planes == 1:
                        raise
                    raise error.of(number) from error
        except BaseException:
            self.close()
            raise

    def confirm(self, meanwhile: Meanwhile) -> None:
        """Ask a person to agree to the first motion. Raises UserError, and what `meanwhile` raises."""
        self._ask(BEFORE_MOTION.format(self._settings.safety.motor_pull), meanwhile)

    def _watched(self, camera: Camera, tracker: Tracker) -> InlineTracking:
        return ThreadedTracking(camera, tracker, self._keep)

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
        super().close()
        for camera in self._devices:
            camera.close()
        self.transport.close()


Testbed = EmulatedTestbed | RealTestbed


def open_testbed(
    settings: RigSettings, wrist: WristParameters, seed: int, view: View, ask: Ask, keep: Kept | None = None,
    view_2: View | None = None,
) -> Testbed:  # fmt: skip
    """The stand of these settings, with the views of its cameras. Raises BoardError and CameraError.

    `keep` takes what both cameras see; of a real rig, or in real time, each calls it from a thread of its own.
    """
    views = view, view_2 or View()
    if settings.port is not None:
        return RealTestbed(settings, views, keep, ask)
    build = connect if settings.real_time else VirtualBench
    markers_2 = settings.markers_2 if settings.planes == 2 else None
    return EmulatedTestbed(build(settings.bench, wrist, seed, settings.markers, markers_2), settings, views, keep)
