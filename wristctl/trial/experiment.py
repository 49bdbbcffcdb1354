"""The experiment from the first command to the last: connect, home, trials and returns, and the stop that ends it.

What it is performed on is a part of it, a `Stand`: it connects, homes, begins trials, checks the tendons and stops.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError, fix_of
from wristctl.interrupt import undisturbed
from wristctl.simulation.motion import Motion
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.control_loop import AtZero, ControlLoop, Shown, course_of
from wristctl.trial.homing import Zero
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog
from wristctl.trial.motion_limit import asked_at_most
from wristctl.trial.motions import back, motion_of
from wristctl.trial.motors_ready import Halt
from wristctl.trial.rig_belief import RigBelief, layout_of_rig, names_of_planes, numbers_of
from wristctl.trial.rig_drive import LookPaces
from wristctl.trial.rig_settings import as_modelled
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import Steering
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.trials import Trial, motions_of
from wristctl.trial.watch import Watch
from wristctl.vision.camera_pose import CameraPose
from wristctl.wrist.directions import in_plane
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.plant import plant_in

log = logging.getLogger(__name__)

Stand = BoardStand | RigStand


class Stop:
    """Why, when (on the time of the trial, where one went on) and how an experiment was stopped before its end."""

    def __init__(self, error: BaseException, trial: int | None, time: float | None, halted: Halt) -> None:
        self.reason = f"{type(error).__name__}: {error}"
        if isinstance(error, UserError):
            self.reason = error.what
        elif isinstance(error, KeyboardInterrupt):
            self.reason = "interrupted by the operator"
        self.trial, self.time, self.halt = trial, time, halted

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        status = self.halt.status
        board: dict[str, Any] = {"state": None, "faults": None, "position": None, "rate": None}
        if status is not None:
            faults = status.faults.name or "none"
            board |= {"state": status.state.name, "faults": faults, "position": status.position, "rate": status.rate}
        return {
            "reason": self.reason,
            "trial": self.trial,
            "time": self.time,
            "motors_stand": self.halt.verified,
            "how": self.halt.how,
            "seconds": self.halt.seconds,
            **board,
        }


class Experiment:
    """Trials one after the other; `outcomes` holds how each trial that began has ended, `odd` what was odd in it,
    `most` the largest of each residual in any, `zero` and `poses` what the stand has found, `stop` why they ended
    early.

    Raises UserError for what is wrong with controllers, gains or motions.
    """

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, trials: Sequence[Trial], kept: TrialLog,
        network: Inverse | None = None, tuned: Mapping[str, Mapping[str, float]] | None = None,
        live: LiveReference | None = None,
    ) -> None:  # fmt: skip
        self._settings, self._layout = settings.within(wrist), layout_of_rig(settings, wrist)
        self._wrist = spared(wrist, self._settings)
        self._trials, self._log, self._live = trials, kept, live
        chosen = [(controller(row.controller), row.gains) for row in settings.rows]
        self._laws = [(law, gains_of(law, gains, tuned)) for law, gains in chosen]
        self._back = controller("feedforward")
        self.motions = self._motions(self._settings, network)
        self.timing = TickTiming(settings.control_period)
        if settings.rig is not None:
            self.timing.camera = LookPaces(settings.rig)
        self.outcomes: dict[int, str] = {}
        self.stop: Stop | None = None
        self.most, self.odd = dict[str, float](), dict[int, str]()
        self.zero: Zero | None = None
        self.poses: dict[str, CameraPose | None] = {}
        self._under_way: tuple[int, float] | None = None  # number and start of the trial that goes on
        self._in_doubt: int | None = None  # the trial that has ended, until its tendons have been looked at

    def _motions(self, settings: HwRunSettings, network: Inverse | None = None) -> dict[str, Motion]:
        wrist = as_modelled(self._wrist, self._layout, settings.planes)
        return {name: motion_of(settings, wrist, name, network) for name in motions_of(settings)}

    def replay(self, settings: HwRunSettings) -> None:
        """Judge the trials by motions of these settings: those of a live reference are known afterwards."""
        self.motions = self._motions(settings)

    def run(self, stand: Stand, shown: Shown | None = None) -> None:
        """Do all trials, and close the stand. Whatever ends them early, the motors are stopped before it is raised.

        Raises SafetyStop, what the stand raises, KeyboardInterrupt, and what a bug raises.
        """
        try:
            self._warm_up(self._trials[0].plane if self._settings.planes == 1 else "")
            stand.open(self._settings, self._wrist, self._log)
            with self._stopping(stand):
                self._all(stand, shown)
            with undisturbed():
                halted = stand.stop(early=False)
            if not halted.verified:
                log.warning("after the last trial: %s", halted.how)
        finally:
            self.zero, self.poses = stand.zero, stand.poses
            with undisturbed():
                stand.close()

    def _all(self, stand: Stand, shown: Shown | None) -> None:
        loop: ControlLoop | None = None
        for trial in self._trials:
            ready = stand.ready(trial, loop)
            loop = loop if ready is None else self._at_rest(ready, shown)
            assert loop is not None
            self._one(stand, loop, trial)
            ready = stand.check()
            self._in_doubt = None
            loop = None if ready is None else self._at_rest(ready, shown)

    def _at_rest(self, ready: AtZero, shown: Shown | None) -> ControlLoop:
        """A loop that has brought the homed, slack wrist to rest at zero."""
        facing = self._facing(ready.plane)
        loop = ControlLoop(ready, self._settings, facing, self.timing, self._log, shown, self._layout)
        loop.follow(self._to_rest(0.0, self._settings.rest, 0.0), self._back, ())
        return loop

    def _one(self, stand: Stand, loop: ControlLoop, trial: Trial) -> None:
        """One trial, whose residuals are kept however it ends, and the way back to zero."""
        start, motion, (law, gains) = loop.next_tick, self.motions[trial.direction], self._laws[trial.row]
        self._under_way, self.outcomes[trial.number] = (trial.number, start), "begun"
        faults = stand.begin(trial, motion, start)
        try:
            loop.follow(motion, law, gains, trial.number, faults, trial.push != 0.0, self._live)
        finally:
            self.most = {name: max(size, self.most.get(name, 0.0)) for name, size in loop.watch.most.items()}
            self.odd[trial.number] = loop.watch.words()
        self._trial_ended(stand, "ok")
        self._in_doubt = trial.number
        final = motion.final if self._live is None else self._live.bend
        loop.follow(self._to_rest(final, self._settings.back, 0.0), self._back, ())

    def _trial_ended(self, stand: Stand, outcome: str) -> None:
        if self._under_way is not None:
            number, start = self._under_way
            self.outcomes[number], self._under_way = outcome, None
            self._log.truth(number, stand.truth(start))

    @contextmanager
    def _stopping(self, stand: Stand) -> Iterator[None]:
        """Whatever ends the block early, the stand is stopped before its cause is raised."""
        try:
            yield
        except BaseException as error:
            cause = cause_of(error)
            with undisturbed():
                self._stopped(stand, cause)
            if cause is not error:
                raise cause from error
            raise

    def _stopped(self, stand: Stand, error: BaseException) -> None:
        decided = stand.now()
        halted = stand.stop(early=True)
        trial, start = self._under_way or (None, None)
        self.stop = Stop(error, trial, None if start is None else decided - start, halted)
        if self._in_doubt is not None and isinstance(error, SafetyStop):
            self.outcomes[self._in_doubt] = f"after it: {self.stop.reason.removeprefix('stopped: ')}"
        self._log.disk.give_up_reserve()
        try:
            self._trial_ended(stand, self.stop.reason)
        except (OSError, UserError) as lost:
            error.add_note(f"what the bench knows of the trial is lost: {lost}")

    def _facing(self, plane: str) -> WristParameters:
        """The wrist as a loop in this plane knows it, or in both."""
        wrist = as_modelled(self._wrist, self._layout, self._settings.planes)
        return in_plane(wrist, plane) if plane else wrist

    def _to_rest(self, bend: Any, duration: float, rest: float) -> Motion:
        return back(bend, duration, rest, self._settings.control_period, self._settings.planes)

    def _warm_up(self, plane: str) -> None:
        """Have all compiled or loaded before the first motor is on: from then on a rig wants to be fed.

        It is for a loop in this plane; empty: in both.
        """
        settings, period, facing = self._settings, self._settings.control_period, self._facing(plane)
        belief = RigBelief(facing, settings.actuator, names_of_planes(settings.planes, plane), self._layout)
        spools, course = spools_of(settings.actuator), course_of(self._to_rest(0.0, settings.rest, 0.0))
        taut, _ = belief.taut(course[0, :, 0])
        still, reeled = np.zeros(len(taut)), belief.at_places(taut)
        spools.target(still, taut)
        spools.rate(still, still, still, period)
        spools.behind(still, still, still, period)
        rates = np.zeros((len(taut), remembered_commands(spools.timing.delay, period)))
        spools.foreseen(still, rates, period)
        spools.reckoned(still, rates, 0.0, period)
        Watch(settings, facing, plane, self.timing, layout=self._layout).predict(reeled)
        steering = Steering(belief, settings.sensor, period)
        for law, gains in [*self._laws, (self._back, ())]:
            steering.use(law, gains)
            steering.respond(course)
            steering.predict(reeled)
        steering.see(0, 0.0, 0.0)


def spared(wrist: WristParameters, settings: HwRunSettings) -> WristParameters:
    """The wrist with tensions that its motors can hold. Raises UserError where these are not above pretension."""
    limit = asked_at_most(settings, wrist)
    if limit <= wrist.pretension:
        problem = f"motors of {settings.safety.motor_pull:g} N cannot hold a pretension of {wrist.pretension:g} N"
        raise UserError(problem, "safety.motor_pull", "more current (documentation: The rig), or less wrist.pretension")
    return wrist.model_copy(update={"tension_limit": limit})


def cause_of(error: BaseException) -> BaseException:
    """The safety stop behind a disk that takes no more rows; any other error as it is."""
    if isinstance(error, OSError):
        return SafetyStop(f"the log cannot be written: {error.strerror}", str(error.filename or "data"), fix_of(error))
    return error


def log_of(folder: Path, settings: HwRunSettings, wrist: WristParameters, monotonic: bool = False) -> TrialLog:
    """The files that an experiment with these settings leaves: an emulated one has the true wrist's too."""
    own, coordinates = settings.rig is not None, None
    if not own and settings.port is None:
        bench = settings.bench
        coordinates = plant_in(settings.planes, bench.plant.model).coordinates(bench.segments)
    return TrialLog(
        folder, coordinates, settings.control_period, monotonic, settings.load_cells is not None, settings.planes,
        numbers_of(layout_of_rig(settings, wrist)), not own,
    )  # fmt: skip
