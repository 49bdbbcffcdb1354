"""The experiment from the first command to the last: connect, home, trials and returns, and the stop that ends it."""

from collections.abc import Mapping, Sequence

import numpy as np

from wristctl.board.driver import Board
from wristctl.board.messages import AXES
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.interrupt import undisturbed
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.simulation.worlds import Draws
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.control_loop import ControlLoop, Shown, course_of
from wristctl.trial.drives import BoardDrive
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.homing import Zero, find_zero, slacken
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog
from wristctl.trial.motions import back
from wristctl.trial.motors_ready import after_a_fault, halt, prepare
from wristctl.trial.resting import judge_rest
from wristctl.trial.rig_belief import RigBelief, names_of_planes
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import HostFaults, Steering
from wristctl.trial.supervised_wait import Patience, medians
from wristctl.trial.tendon_pulls import tendon_pulls_of
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.tracking import Tracking
from wristctl.trial.trial_series import TrialSeries, spared
from wristctl.trial.trials import Trial
from wristctl.trial.watch import Watch
from wristctl.trial.zero_checks import check_cocontraction, check_tendons, check_zero
from wristctl.wrist.directions import in_plane
from wristctl.wrist.kinematics import Inverse


class Experiment(TrialSeries):
    """Trials on the motor board with its cameras, real or emulated. Raises UserError as TrialSeries does."""

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, trials: Sequence[Trial], kept: TrialLog,
        network: Inverse | None = None, tuned: Mapping[str, Mapping[str, float]] | None = None,
        calibration: WristCalibration | None = None, seed: int = 0, live: LiveReference | None = None,
    ) -> None:  # fmt: skip
        settings = settings.within(wrist)
        timing = TickTiming(settings.control_period)
        super().__init__(settings, spared(wrist, settings), wrist, trials, kept, timing, network, tuned, live)
        self._pulls = tendon_pulls_of(settings)
        self._calibration, self._draws = calibration, Draws(seed, "bench")
        self.zero: Zero | None = None

    def run(self, testbed: Testbed, shown: Shown | None = None) -> None:
        """Do all trials, and close the stand. Whatever ends them early, the motors are stopped before it is raised.

        Raises SafetyStop, BoardError, CameraError, KeyboardInterrupt, and what a bug raises.
        """
        board = Board(testbed.transport, self._log.wire)
        board.cells = self._pulls
        try:
            self._warm_up()
            board.connect()
            with self._stopping(lambda cause: self._stopped(testbed, board, cause)):
                self._all(testbed, board, shown)
            with undisturbed():
                halt(board, self._settings.safety.watchdog)
                board.close()
        finally:
            testbed.close()

    def _warm_up(self) -> None:
        """Have everything compiled or loaded before the first motor is on: from then on the board wants to be fed."""
        settings, plane = self._settings, self._trials[0].plane
        belief = RigBelief(self._facing(plane), settings.actuator, names_of_planes(settings.planes, plane))
        spools, still = spools_of(settings.actuator), np.zeros(AXES)
        motion = back(0.0, settings.rest, 0.0, settings.control_period, settings.planes)
        course = course_of(motion)
        taut, _ = belief.taut(course[0, :, 0])
        spools.target(still, taut)
        spools.rate(still, still, still, settings.control_period)
        spools.behind(still, still, still, settings.control_period)
        rates = np.zeros((AXES, remembered_commands(spools.timing.delay, settings.control_period)))
        spools.foreseen(still, rates, settings.control_period)
        spools.reckoned(still, rates, 0.0, settings.control_period)
        reeled = belief.at_places(taut)
        Watch(settings, self._facing(plane), plane, self.timing).predict(reeled)
        self._warm_up_controllers(Steering(belief, settings.sensor, settings.control_period), course, reeled)

    def _all(self, testbed: Testbed, board: Board, shown: Shown | None) -> None:
        plane: str | None = None
        loop: ControlLoop | None = None
        for trial in self._trials:
            bends_in = trial.plane if self._settings.planes == 1 else ""  # one set-up sees both planes
            if loop is None or bends_in != plane:
                patience = Patience(board) if loop is None else loop.patience(board, self._signs)
                testbed.face(trial.direction, patience.pulse)
                loop, tracking = self._loop(testbed, board, bends_in, shown)
                plane = bends_in
            self._one(testbed, loop, trial)
            loop = self._relaxed(board, tracking, bends_in, shown)

    def _loop(
        self, testbed: Testbed, board: Board, plane: str, shown: Shown | None
    ) -> tuple[ControlLoop, Tracking]:  # fmt: skip
        """A loop at rest at zero in this plane, and its camera; the first one homes the board, others read the slack
        wrist's marker."""
        settings, tracking = self._settings, testbed.tracking()
        if self.zero is not None:
            self._let_go(board, self.zero)
        watching = Patience(board)
        names = names_of_planes(settings.planes, plane)
        self.poses |= dict(zip(names, watching.stand_square(tracking, settings.homing), strict=True))
        seen = watching.sightings(tracking, 4 * settings.homing.frames)
        markers = medians(seen, settings.planes)
        watching.pace.fits(settings.safety.stale)
        if settings.planes == 2:  # what one camera sees of a bend depends on the other
            tracking.zero = markers
        if self.zero is None:  # the marker is seen, and nothing moves yet
            judge_rest(seen, settings, self._wrist, names)
            testbed.confirm(Patience(board).pulse)
            with after_a_fault(prepare(board, settings)):
                self.zero = self._home(board, tracking, plane)
            markers = self.zero.markers
        else:
            markers = check_zero(board, tracking, settings, self._wrist, plane, self.zero)
        tracking.zero = markers
        return self._at_rest(board, tracking, plane, shown), tracking

    def _at_rest(self, board: Board, tracking: Tracking, plane: str, shown: Shown | None) -> ControlLoop:
        """A loop that has brought the homed, slack wrist to rest at zero."""
        settings, pose, zero = self._settings, self.poses.get(plane), self.zero
        assert zero is not None
        stiffness = ExpectedMoves(settings, self._wrist, plane).tendon_stiffness(zero.steps_per_radian)
        loop = ControlLoop(
            BoardDrive(board, settings, zero.signs), tracking, settings, self._facing(plane), plane, self.timing,
            self._log, shown, 0.0 if pose is None else pose.oblique, self._pulls, stiffness,
        )  # fmt: skip
        loop.follow(back(0.0, settings.rest, 0.0, settings.control_period, settings.planes), self._back, ())
        return loop

    @property
    def _signs(self) -> tuple[int, ...]:
        assert self.zero is not None
        return self.zero.signs

    def _facing(self, plane: str) -> WristParameters:
        """The wrist as a loop in this plane knows it, or in both."""
        return self._wrist if self._settings.planes == 2 else in_plane(self._wrist, plane)

    def _relaxed(self, board: Board, tracking: Tracking, plane: str, shown: Shown | None) -> ControlLoop:
        """After a trial see that no tendons pull against each other and that none is lost; rest at zero again."""
        assert self.zero is not None
        told = check_cocontraction(board, tracking, self._settings, self._wrist, plane, self.zero)
        if told and self._settings.planes == 2:
            check_tendons(board, tracking, self._settings, self._wrist, self.zero)
        self._in_doubt = None
        return self._at_rest(board, tracking, plane, shown)

    def _home(self, board: Board, tracking: Tracking, plane: str) -> Zero:
        settings, calibration = self._settings, self._calibration
        if calibration is not None and settings.positions == "stored":
            if len(calibration.zero.markers) != settings.planes:
                problem = f"the calibration knows {len(calibration.zero.markers)} cameras of {settings.planes}"
                raise UserError(problem, "calibration", "positions: find, or calibrate the wrist with the same planes")
            calibration.restore(board)
            self._let_go(board, calibration.zero)
            check_zero(board, tracking, settings, self._wrist, plane, calibration.zero)
            return calibration.zero
        signs = calibration.zero.signs if calibration else None
        return find_zero(board, tracking, settings, self._wrist, plane, signs)

    def _let_go(self, board: Board, zero: Zero) -> None:
        """Slacken the tendons, and give the wrist time to straighten."""
        slacken(board, spools_of(self._settings.actuator), self._settings.homing, zero.signs)
        Patience(board).wait(self._settings.homing.let_go)

    def _one(self, testbed: Testbed, loop: ControlLoop, trial: Trial) -> None:
        """One trial, and the way back to zero."""
        settings, start = self._settings, loop.next_tick
        self._begun(trial, start)
        testbed.begin(
            start,
            trial.disturbances(settings, self.motions[trial.direction]),
            self._draws.camera(trial.scenario, trial.repetition),
        )
        self._follow(loop, trial, HostFaults(settings.bench.faults) if testbed.emulated else None)
        self._trial_ended(testbed, "ok")
        self._in_doubt = trial.number
        way = back(self._final(trial), settings.back, 0.0, settings.control_period, settings.planes)
        loop.follow(way, self._back, ())

    def _trial_ended(self, testbed: Testbed, outcome: str) -> None:
        if self._under_way is not None:
            number, start = self._under_way
            self.outcomes[number], self._under_way = outcome, None
            self._log.truth(number, testbed.truth(start))

    def _stopped(self, testbed: Testbed, board: Board, error: BaseException) -> None:
        """Stop the motors and let the board go, then note what happened."""
        decided = board.transport.now()
        halted = halt(board, self._settings.safety.watchdog)
        if self._settings.safety.hold and halted.verified:
            board.transport.close()  # the board's watchdog ends it, and holds
        else:
            board.close(emergency=not halted.verified)
        stop = self._note_stop(error, decided, halted)
        try:
            self._trial_ended(testbed, stop.reason)
        except (OSError, UserError) as lost:
            error.add_note(f"what the bench knows of the trial is lost: {lost}")
