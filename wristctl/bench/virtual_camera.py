"""The bench's camera in virtual time: only the frames that somebody sees are drawn."""

from __future__ import annotations

from wristctl.bench.exposure import picture
from wristctl.bench.rig import Rig
from wristctl.vision.camera import CameraError, Frame


class VirtualCamera:
    """Sees what stands on a rig; frames arrive as the chip's clock goes on."""

    name = "rendered"

    def __init__(self, rig: Rig) -> None:
        self._rig, self._seen = rig, -1

    def newest(self) -> Frame | None:
        """The newest frame that has arrived since the last call, None if none has. Raises CameraError."""
        self._rig.catch_up()
        if self._rig.faults.on("camera-lost", self._rig.wrist.time):
            raise CameraError("the camera gives no more pictures", self.name, "injected fault")
        shutter = self._rig.shutter
        newest = shutter.newest(shutter.delay)
        unseen, self._seen = range(newest, self._seen, -1), max(newest, self._seen)
        number = next(filter(shutter.arrives, unseen), None)
        return None if number is None else picture(shutter.expose(number), self._rig.scene)

    def close(self) -> None:
        """Nothing to give back."""
