"""Trials on a rig that takes targets, from the first call to the last: connect, home, trials, returns, and the stop."""

import logging
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.interrupt import undisturbed
from wristctl.trial.control_loop import ControlLoop, Shown
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.homing import Zero
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog
from wristctl.trial.motors_ready import Halt
from wristctl.trial.rig_belief import layout_of_rig
from wristctl.trial.rig_drive import LookPaces, RigDrive, RigTracking
from wristctl.trial.rig_homing import PLANE, RigHoming
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.rig_settings import sides_of
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.trial_series import TrialSeries, spared
from wristctl.trial.trials import Trial
from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

# Seconds within which motors stand after stop(), and between the looks that show it.
_PATIENCE, _APART = 0.5, 0.05
# Share of `homing.bend_deg` that a wrist whose motors stand may move by between two looks.
_STANDS = 0.3

BEFORE_MOTION = (
    "The rig will now move. Its power switch within reach, nobody's hands in the tendons, wrist straight, and all "
    "tendons slack?"
)


def halt_rig(rig: GuardedRig, bend: float) -> Halt:
    """Stop a rig's motors, and see by its looks that the wrist stands; never raises.

    `bend` is the change of a bend [rad] between two looks that counts as none.
    """
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


class RigExperiment(TrialSeries):
    """Trials on a rig that takes targets."""

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, trials: Sequence[Trial], kept: TrialLog,
        network: Inverse | None = None, tuned: Mapping[str, Mapping[str, float]] | None = None,
        live: LiveReference | None = None,
    ) -> None:  # fmt: skip
        settings = settings.within(wrist)
        layout = layout_of_rig(settings, wrist)
        assert layout is not None
        wrist = spared(wrist, settings)
        self._layout, self._facing = layout, wrist if settings.planes == 2 else sides_of(wrist, layout)
        timing = TickTiming(settings.control_period, camera=LookPaces(settings.rig or ""))
        super().__init__(settings, wrist, self._facing, trials, kept, timing, network, tuned, live)
        self.zero: Zero | None = None

    def run(self, rig: GuardedRig, shown: Shown | None = None, confirm: Callable[[], None] | None = None) -> None:
        """Do all trials and close the rig. Whatever ends them early, the rig is stopped before it is raised.

        `confirm` has a person agree to the first motion. Raises SafetyStop, RigStop, KeyboardInterrupt, and what a bug
        raises.
        """
        try:
            self._warm_up(self._facing, PLANE, self._layout)
            self._warm_up_drive(rig)
            with self._stopping(lambda cause: self._stopped(rig, cause)):
                self._all(rig, shown, confirm)
            with undisturbed():
                halted = halt_rig(rig, self._still)
            if not halted.verified:
                log.warning("after the last trial: %s", halted.how)
        finally:
            with undisturbed():
                if trouble := rig.close():
                    log.warning("the rig could not be closed: %s", trouble)

    @property
    def _still(self) -> float:
        return _STANDS * math.radians(self._settings.homing.bend_deg)

    def _warm_up_drive(self, rig: GuardedRig) -> None:
        """Have it compiled before a rig is connected that may stop by itself where it hears nothing."""
        drive = RigDrive(rig, self._settings, np.zeros(len(self._layout.places)))
        drive.begin()
        drive.go_on(1)

    def _all(self, rig: GuardedRig, shown: Shown | None, confirm: Callable[[], None] | None) -> None:
        if confirm is not None:
            confirm()
        motors, tracking = RigMotors(rig, self._settings, rig.connect()), RigTracking(rig)
        homing = RigHoming(motors, tracking, self._settings, self._wrist, self._layout, rig.where)
        zero = self.zero = homing.find()
        for trial in self._trials:
            drive = RigDrive(rig, self._settings, np.array(zero.targets))
            drive.at(motors.targets)
            loop = ControlLoop(
                drive, tracking, self._settings, self._facing, PLANE, self.timing, self._log, shown, layout=self._layout
            )
            loop.follow(self._to_rest(0.0, self._settings.rest, 0.0), self._back, ())
            self._one(loop, trial)
            motors.left_at(drive.targets)
            homing.check()
            self._in_doubt = None

    def _one(self, loop: ControlLoop, trial: Trial) -> None:
        """One trial, and the way back to zero."""
        self._begun(trial, loop.next_tick)
        self._follow(loop, trial)
        self.outcomes[trial.number], self._under_way = "ok", None
        self._come_back(loop, trial)

    def _stopped(self, rig: GuardedRig, error: BaseException) -> None:
        """Stop the rig, then note what happened."""
        try:
            decided = rig.now()
        except UserError:
            decided = math.nan
        stop = self._note_stop(error, decided, halt_rig(rig, self._still))
        if self._under_way is not None:
            self.outcomes[self._under_way[0]] = stop.reason
