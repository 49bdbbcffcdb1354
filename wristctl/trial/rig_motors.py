"""Motors of a rig that takes targets, as homing moves them: in microsteps of `actuator.step_length`."""

import math
from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import Fault, Flag, State, Status
from wristctl.config.hw_run import HwRunSettings
from wristctl.rig import most
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.safety import SafetyStop

# Tendon reeled in or let out while homing [m/s], and seconds between two targets.
_SLOWLY, _EVERY = 5e-3, 0.02


class RigMotors:
    """`Motors` of a rig that was connected at the targets `stood` (T,) [facts.unit]; their clock is the rig's.

    Positions are counted from there, and from where `home` was called last.
    """

    cells = None

    def __init__(self, rig: GuardedRig, settings: HwRunSettings, stood: Array) -> None:
        self._rig, self._facts = rig, rig.facts
        self._unit, self._step = rig.facts.metres_per_unit, settings.actuator.step_length
        self._zero, self._at = np.asarray(stood, float), np.zeros(len(stood))
        drive = rig.facts.drive
        self._settles = most(drive.delay) + 5.0 * most(drive.lag)
        self._every = min(_EVERY, (rig.facts.silence or math.inf) / 4.0)
        self.transport = self

    @property
    def targets(self) -> Array:
        """Targets (T,) that were sent last [facts.unit]."""
        return self.targets_at(self._at)

    def targets_at(self, position: Array) -> Array:
        """Targets (T,) [facts.unit] of a position (T,) [m]."""
        targets: Array = self._zero + position / self._unit
        return targets

    def left_at(self, targets: Array) -> None:
        """Say that others have sent the rig to these targets (T,) [facts.unit]."""
        self._at = (targets - self._zero) * self._unit

    def reel(self, position: Array) -> None:
        """Go slowly to a position (T,) [m], and wait until the motors are there."""
        pace = min(_SLOWLY, 0.5 * self._facts.limits.rate) * self._every
        while (left := position - self._at).any():
            self._at = self._at + np.clip(left, -pace, pace)
            self._rig.send(self.targets)
            self._rig.wait_until(self._rig.now() + self._every)
        self.wait(self._settles)

    def now(self) -> float:
        """On the rig's clock [s]."""
        return self._rig.now()

    def wait(self, seconds: float) -> None:
        """Let time pass; the rig hears its targets again and again."""
        end = self._rig.now() + seconds
        while (now := self._rig.now()) < end:
            self.ping()
            self._rig.wait_until(min(end, now + self._every))

    def ping(self) -> None:
        """The targets once more: a rig may stop by itself where it hears nothing."""
        self._rig.send(self.targets)

    def read(self) -> Status:
        """Positions (T,) as they were sent; what stops a rig raises."""
        position, still = tuple(np.rint(self._at / self._step).astype(int).tolist()), (0,) * len(self._at)
        return Status(self._rig.now(), State.ENABLED, Fault(0), Flag(0), math.inf, position, still, 0)  # type: ignore[arg-type]

    def jog(self, positions: Sequence[int]) -> Status:
        """As `reel`, to positions (T,) [steps]."""
        self.reel(np.array(positions, float) * self._step)
        return self.read()

    def go_to(self, positions: Sequence[int], rate: int) -> Status:
        """As `jog`, at the pace of homing."""
        return self.jog(positions)

    def home(self) -> Status:
        """Where the motors stand is zero."""
        self._zero, self._at = self.targets, np.zeros(len(self._at))
        return self.read()

    def faulted(self, status: Status) -> SafetyStop:
        """A rig's fault is raised by the call that meets it."""
        return SafetyStop("the rig has stopped", self._rig.where)

    def see_restart(self) -> None:
        """A rig that is another one raises by itself."""
