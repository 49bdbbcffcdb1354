"""The emulated bench in virtual time: board, wrist and camera in this process, the same in every run."""

from __future__ import annotations

from wristctl.bench.bench_transport import BenchTransport
from wristctl.bench.bench_wrist import MotorMotion, Truth
from wristctl.bench.rig import Rig
from wristctl.bench.virtual_camera import VirtualCamera
from wristctl.config.bench import BenchSettings
from wristctl.config.plant import Disturbances
from wristctl.config.vision import Markers
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy


class VirtualBench:
    """A wrist pulled by the step pulses of an emulated board, and a camera that sees it.

    Time passes while `transport` is waited on, and is of its clock.
    """

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, seed: int, markers: Markers | None = None
    ) -> None:
        self._rig = Rig(settings, wrist, seed, markers)
        self.transport = BenchTransport(self._rig.chip, self._rig.faults, settings.line.latency_timer)
        self.camera = VirtualCamera(self._rig)

    def face(self, direction: str) -> None:
        """Turn the bench so that this direction's plane is the one that bends and is seen."""
        self._rig.face(direction)

    def disturb(self, disturbances: Disturbances, start: float) -> None:
        """Let these act from `start` on, beside no trial: faults and the camera's stream go on as they are."""
        self._rig.disturb(disturbances, start)

    def begin(self, start: float, disturbances: Disturbances | None = None, noise: Entropy | None = None) -> None:
        """A trial's motion begins at `start`: disturbances, faults and frames of the stream `noise` count from it."""
        self._rig.begin(start, disturbances, noise)

    def truth(self, since: float = 0.0) -> Truth:
        """What the wrist did after `since`, as far back as the last minute."""
        self._rig.catch_up()
        return self._rig.wrist.truth(since)

    def motion(self) -> MotorMotion:
        """What the board has made of its motors so far."""
        self._rig.catch_up()
        return self._rig.wrist.motion

    def close(self) -> None:
        """Nothing to give back: here so that every bench ends alike."""
