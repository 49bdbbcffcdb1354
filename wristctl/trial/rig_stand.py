"""A rig that takes targets, as experiments are performed on it."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.motion import Motion
from wristctl.trial.control_loop import AtZero, ControlLoop
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.homing import Zero, find_zero
from wristctl.trial.log import TrialLog
from wristctl.trial.motors_ready import Halt
from wristctl.trial.resting import judge_looks, judge_weight
from wristctl.trial.rig_belief import layout_of_rig, names_of_planes
from wristctl.trial.rig_drive import RigDrive, RigTracking
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.trials import Trial
from wristctl.trial.zero_checks import HomedWrist
from wristctl.vision.camera_pose import CameraPose

log = logging.getLogger(__name__)

# The plane of a rig that bends in one.
PLANE = "ulnar"
# Seconds within which motors stand after stop(), and between the looks that show it.
_PATIENCE, _APART = 0.5, 0.05
# Share of `homing.bend_deg` that a wrist whose motors stand may move by between two looks.
_STANDS = 0.3

BEFORE_MOTION = (
    "The rig will now move. Its power switch within reach, nobody's hands in the tendons, wrist straight, and all "
    "tendons slack?"
)


def halt_rig(rig: GuardedRig, settings: HwRunSettings) -> Halt:
    """Stop a rig's motors, and see by its looks that the wrist stands; never raises."""
    bend = _STANDS * math.radians(settings.homing.bend_deg)
    trouble, seconds, stands, seen = rig.stop(), 0.0, False, False
    try:
        began = rig.now()
        before = rig.look().bend
        while not stands and seconds < _PATIENCE:
            rig.wait_until(rig.now() + _APART)
            now = rig.look().bend
            seen = bool(np.isfinite(now - before).all())
            stands = seen and math.hypot(*(now - before)) < bend
            before, seconds = now, rig.now() - began
    except UserError as error:
        trouble = trouble or str(error.what)
    if stands and not trouble:
        return Halt(True, "stop(), and the wrist stands", None, seconds)
    why = "the wrist still moves" if seen else "its bend is not seen"
    return Halt(False, f"{trouble or why}; cut the motors' power", None, seconds)


class RigStand:
    """A rig as an experiment has it, as `BoardStand`; `confirm` has a person agree to the first motion.

    Raises SafetyStop and RigStop.
    """

    def __init__(self, rig: GuardedRig, confirm: Callable[[], None] = lambda: None) -> None:
        self._rig, self._confirm = rig, confirm
        self.zero: Zero | None = None
        self.poses = dict[str, CameraPose | None]()

    def open(self, settings: HwRunSettings, wrist: WristParameters, log: TrialLog) -> None:
        """Have its drive compiled before it is connected: it may stop by itself where it hears nothing."""
        layout = layout_of_rig(settings, wrist)
        assert layout is not None
        self._settings, self._wrist, self._layout = settings, wrist, layout
        self._plane = PLANE if settings.planes == 1 else ""
        drive = RigDrive(self._rig, settings, np.zeros(len(layout.places)))
        drive.begin()
        drive.go_on(1)

    def now(self) -> float:
        """On the rig's clock."""
        try:
            return self._rig.now()
        except UserError:
            return math.nan

    def ready(self, trial: Trial, loop: ControlLoop | None) -> AtZero:
        """The wrist, homed once: the rig is connected before its first trial."""
        if self.zero is None:
            self._confirm()
            self._drive = RigDrive(self._rig, self._settings, self._rig.connect())
            self._tracking = RigTracking(self._rig)
            self.zero = self.home()
        expected = ExpectedMoves(self._settings, self._wrist, self._plane, self._layout)
        wound_by = expected.wound_by(self.zero.steps_per_radian)
        return AtZero(self._drive, self._tracking, self._plane, wound_by=wound_by)

    def home(self) -> Zero:
        """Zero of a connected rig, at which its tendons stand then; bends are of the straight wrist from here on."""
        settings, motors, tracking = self._settings, self._drive, self._tracking
        judge_weight(settings, self._wrist, names_of_planes(settings.planes, PLANE))
        judge_looks(Patience(motors).sightings(tracking, 4 * settings.homing.frames), settings, self._rig.where)
        zero = find_zero(motors, tracking, settings, self._wrist, self._plane, layout=self._layout)
        expected = ExpectedMoves(settings, self._wrist, self._plane, self._layout)
        placed = tuple(expected.place(axis) for axis in range(len(zero.slack)))
        tracking.zero = zero.markers
        return replace(zero, directions=zero.directions or placed, targets=tuple(motors.targets.tolist()))

    def begin(self, trial: Trial, motion: Motion, start: float) -> None:
        """Nothing is injected."""

    def truth(self, start: float) -> Array:
        """Nobody knows."""
        return np.empty((0, 0))

    def check(self) -> None:
        """As `BoardStand.check`, and that the wrist rests straight; it stays slack until the next trial."""
        assert self.zero is not None
        drive, tracking = self._drive, self._tracking
        homed = HomedWrist(drive, tracking, self._settings, self._wrist, self._plane, self.zero, self._layout)
        homed.check_straight(self._rig.where)
        homed.check_cocontraction()
        homed.check_tendons()

    def stop(self, early: bool) -> Halt:
        """Stop the rig; what holds its tendons is its own."""
        return halt_rig(self._rig, self._settings)

    def close(self) -> None:
        """Close the rig; where that fails it is said."""
        if trouble := self._rig.close():
            log.warning("the rig could not be closed: %s", trouble)
