"""The emulated bench in virtual time: board, wrist and camera in this process, the same in every run."""

from __future__ import annotations

from wristctl.config.bench import BenchSettings
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.hardware.bench.faults import Faults
from wristctl.hardware.bench.transport import BenchTransport
from wristctl.hardware.bench.wrist import BenchWrist, Motion, Truth
from wristctl.hardware.emulator.atmega2560 import Atmega2560


class Bench:
    """A wrist pulled by the step pulses of an emulated board; time passes while `transport` is waited on.

    The wrist does not act back on the board, so it follows only when somebody looks; what it does is the same
    however often that is.
    """

    def __init__(self, settings: BenchSettings, wrist: WristParameters, seed: int) -> None:
        self._chip = Atmega2560()
        self._faults = Faults(settings.faults)
        self._wrist = BenchWrist(settings, wrist)
        self.transport = BenchTransport(self._chip, self._faults)

    def face(self, direction: str) -> None:
        """Turn the bench so that this direction's plane is the one that bends and is seen."""
        self._catch_up()
        self._wrist.face(direction)

    def begin(self, start: float, disturbances: Disturbances | None = None) -> None:
        """A trial's motion starts at `start` on the transport's clock: from there count disturbances and faults."""
        self._catch_up()
        self._wrist.disturb(disturbances or Disturbances(), start)
        self._faults.begin(start)

    def truth(self, since: float = 0.0) -> Truth:
        """What the wrist did after `since` [s on the transport's clock], as far back as the last minute."""
        self._catch_up()
        return self._wrist.truth(since)

    def motion(self) -> Motion:
        """What the board has made of its motors so far."""
        self._catch_up()
        return self._wrist.motion

    def close(self) -> None:
        """Nothing to give back: here so that every bench ends alike."""

    def _catch_up(self) -> None:
        self._wrist.hear(self._chip.events())
        self._wrist.follow(self._chip.cycles)
