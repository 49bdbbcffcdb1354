"""What an experiment is performed on: a board with its cameras, or a rig that takes targets."""

from typing import NamedTuple, Protocol

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.simulation.motion import Motion
from wristctl.trial.control_loop import ControlLoop
from wristctl.trial.drives import LoopDrive
from wristctl.trial.homing import Zero
from wristctl.trial.log import TrialLog
from wristctl.trial.motors_ready import Halt
from wristctl.trial.steering import HostFaults
from wristctl.trial.tendon_pulls import TendonPulls
from wristctl.trial.tracking import Tracking
from wristctl.trial.trials import Trial
from wristctl.vision.camera_pose import CameraPose


class AtZero(NamedTuple):
    """A homed, slack wrist, as a control loop takes it up."""

    drive: LoopDrive
    tracking: Tracking
    plane: str
    """In which it bends; empty for both."""
    oblique: float = 0.0
    """How far off square an uncalibrated camera looks at the plane [rad]."""
    pulls: TendonPulls | None = None
    """By load cells."""
    stiffness: float | None = None
    """Of the tendons as homing has measured it [N/m]; None: as believed."""


class Stand(Protocol):
    """Motors, sensors and the wrist before them. Its calls raise SafetyStop, and the errors of its parts."""

    zero: Zero | None
    """What homing has found; None before."""
    poses: dict[str, CameraPose | None]
    """Pose of each plane's camera; None: calibrated."""

    def open(self, settings: HwRunSettings, wrist: WristParameters, log: TrialLog) -> None:
        """See that all answer, before anything moves; `log` takes what they say."""

    def now(self) -> float:
        """Seconds on its clock; nan where that fails."""

    def ready(self, trial: Trial, loop: ControlLoop | None) -> AtZero | None:
        """The wrist, homed and set up for this trial; None where `loop`, which has brought it to rest, goes on."""

    def begin(self, trial: Trial, motion: Motion, start: float) -> HostFaults | None:
        """The motion of a trial starts at `start` [s]; faults of the loop that are injected into it."""

    def truth(self, start: float) -> Array:
        """Rows of true values of a trial that started then, by the log's columns; none where nobody knows."""

    def check(self) -> AtZero | None:
        """See after a trial that no tendons pull against each other and that none is lost; leaves the wrist slack.

        The wrist, where it is to rest at zero until the next trial; None where it may stay slack.
        """

    def stop(self, early: bool) -> Halt:
        """Stop the motors, `early` or after the last trial, and let them go; never raises for what does not answer."""

    def close(self) -> None:
        """Give everything back."""
