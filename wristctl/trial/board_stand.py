"""The motor board with its cameras, real or emulated, as experiments are performed on it."""

from wristctl.arrays import Array
from wristctl.board.driver import Board
from wristctl.board.messages import AXES
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.motion import Motion
from wristctl.simulation.worlds import Draws
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.control_loop import AtZero, ControlLoop
from wristctl.trial.drives import BoardDrive
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.homing import Zero, find_zero
from wristctl.trial.log import TrialLog
from wristctl.trial.motors_ready import Halt, after_a_fault, halt, prepare
from wristctl.trial.resting import judge_rest
from wristctl.trial.rig_belief import layout_of_rig, names_of_planes, numbers_of
from wristctl.trial.steering import HostFaults
from wristctl.trial.supervised_wait import Motors, Patience, WoundAxes, medians
from wristctl.trial.tendon_pulls import tendon_pulls_of
from wristctl.trial.testbeds import Testbed
from wristctl.trial.trials import Trial
from wristctl.trial.zero_checks import HomedWrist
from wristctl.vision.camera_pose import CameraPose


class BoardStand:
    """A testbed as an experiment has it; `zero` is what homing has found, `poses` are those of each plane's camera,
    None of a calibrated one.

    Raises SafetyStop, BoardError, CameraError, and UserError for a calibration that does not fit.
    """

    def __init__(self, testbed: Testbed, calibration: WristCalibration | None = None, seed: int = 0) -> None:
        self._testbed, self._calibration, self._draws = testbed, calibration, Draws(seed, "bench")
        self.zero: Zero | None = None
        self.poses = dict[str, CameraPose | None]()
        self._plane = ""

    def open(self, settings: HwRunSettings, wrist: WristParameters, log: TrialLog) -> None:
        """See that all answer; nothing moves. `log` takes what is on the wire."""
        self._settings, self._wrist, self._pulls = settings, wrist, tendon_pulls_of(settings)
        self._layout = layout_of_rig(settings, wrist)
        self._board = Board(self._testbed.transport, log.wire)
        self._board.cells = self._pulls
        self._board.connect()
        count = len(numbers_of(self._layout))
        self._motors: Motors = self._board if count == AXES else WoundAxes(self._board, count)

    def now(self) -> float:
        """Seconds on its clock."""
        return self._board.transport.now()

    def ready(self, trial: Trial, loop: ControlLoop | None) -> AtZero | None:
        """The wrist, homed once, and turned to the trial's plane: in two planes one set-up sees both.

        None where it has been already: `loop`, which has brought it to rest, goes on.
        """
        plane = trial.plane if self._settings.planes == 1 else ""
        if loop is not None and plane == self._plane:
            return None
        patience = Patience(self._motors) if loop is None else loop.patience(self._motors, self._signs)
        self._testbed.face(trial.direction, patience.pulse)
        self._tracking, self._plane = self._testbed.tracking(), plane
        self._set_up()
        return self._at_zero()

    def _set_up(self) -> None:
        """See the slack wrist's marker in this plane; the first time home the board, else check what homing found."""
        settings, board, tracking = self._settings, self._board, self._tracking
        if self.zero is not None:
            self._let_go(self._homed(self.zero))
        watching = Patience(board)
        names = names_of_planes(settings.planes, self._plane)
        self.poses |= dict(zip(names, watching.stand_square(tracking, settings.homing), strict=True))
        seen = watching.sightings(tracking, 4 * settings.homing.frames)
        markers = medians(seen, settings.planes)
        watching.pace.fits(settings.safety.stale)
        if settings.planes == 2:  # what one camera sees of a bend depends on the other
            tracking.zero = markers
        if self.zero is None:  # the marker is seen, and nothing moves yet
            judge_rest(seen, settings, self._wrist, names)
            self._testbed.confirm(Patience(board).pulse)
            with after_a_fault(prepare(board, settings)):
                self.zero = self._home()
            markers = self.zero.markers
        else:
            markers = self._homed(self.zero).check_zero()
        tracking.zero = markers

    def _home(self) -> Zero:
        settings, calibration = self._settings, self._calibration
        if calibration is not None and settings.positions == "stored":
            if len(calibration.zero.markers) != settings.planes:
                problem = f"the calibration knows {len(calibration.zero.markers)} cameras of {settings.planes}"
                raise UserError(problem, "calibration", "positions: find, or calibrate the wrist with the same planes")
            calibration.restore(self._board)
            homed = self._homed(calibration.zero)
            self._let_go(homed)
            homed.check_zero()
            return calibration.zero
        signs = calibration.zero.signs if calibration else None
        return find_zero(self._motors, self._tracking, settings, self._wrist, self._plane, signs, layout=self._layout)

    def _homed(self, zero: Zero) -> HomedWrist:
        return HomedWrist(self._motors, self._tracking, self._settings, self._wrist, self._plane, zero, self._layout)

    def _let_go(self, homed: HomedWrist) -> None:
        homed.slacken()
        Patience(self._board).wait(self._settings.homing.let_go)

    def _at_zero(self) -> AtZero:
        assert self.zero is not None
        settings, plane, pose = self._settings, self._plane, self.poses.get(self._plane)
        drive = BoardDrive(self._board, settings, self._signs)
        expected = ExpectedMoves(settings, self._wrist, plane, self._layout)
        steps = self.zero.steps_per_radian
        stiffness, oblique = expected.tendon_stiffness(steps), 0.0 if pose is None else pose.oblique
        return AtZero(drive, self._tracking, plane, oblique, self._pulls, stiffness, expected.wound_by(steps))

    @property
    def _signs(self) -> tuple[int, ...]:
        assert self.zero is not None
        return self.zero.signs

    def begin(self, trial: Trial, motion: Motion, start: float) -> HostFaults | None:
        """The motion of a trial starts at `start` [s]. Returns the loop's own faults where any are injected."""
        noise = self._draws.camera(trial.scenario, trial.repetition)
        self._testbed.begin(start, trial.disturbances(self._settings, motion), noise)
        return HostFaults(self._settings.bench.faults) if self._testbed.emulated else None

    def truth(self, start: float) -> Array:
        """True values since `start` [s], by the log's columns; no rows of a real wrist."""
        return self._testbed.truth(start)

    def check(self) -> AtZero:
        """See that no tendons pull against each other and, in two planes, that each one bends the wrist.

        Returns the slack wrist, which is to rest at zero until the next trial.
        """
        assert self.zero is not None
        homed = self._homed(self.zero)
        if homed.check_cocontraction() and self._settings.planes == 2:
            homed.check_tendons()
        return self._at_zero()

    def stop(self, early: bool) -> Halt:
        """Stop the motors, `early` or after the last trial; the watchdog ends a board that is to hold."""
        halted = halt(self._board, self._settings.safety.watchdog)
        if early and self._settings.safety.hold and halted.verified:
            self._board.transport.close()
        else:
            self._board.close(emergency=not halted.verified)
        return halted

    def close(self) -> None:
        """Give everything back."""
        self._testbed.close()
