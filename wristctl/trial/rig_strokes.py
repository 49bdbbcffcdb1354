"""Strokes of one motor before the camera, and the picture's age that they show."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares, minimize_scalar
from scipy.signal import bilinear, lfilter

from wristctl.arrays import Array
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE, Flag, State, Target
from wristctl.board.transport import underway
from wristctl.config.hw_run import CalibrateWristSettings, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.motors_ready import in_sight, prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tracking import Tracking

# Share of its acceleration that the board plans to brake with (motion.c).
_BRAKING = 0.9
# Seconds before and after the first answer between which it is looked for when a move began.
_EARLY, _LATE = 0.1, 0.05


class RampedMove(NamedTuple):
    """From rest to rest, `distance` steps away, either sign; rates in steps/s, acceleration in steps/s^2."""

    distance: float
    rate: float
    acceleration: float

    def course(self, time: Array) -> Array:
        """Steps made (n,), so many seconds (n,) after it began."""
        far, speeding, braking = abs(self.distance), self.acceleration, _BRAKING * self.acceleration
        top = min(self.rate, math.sqrt(2.0 * far * speeding * braking / (speeding + braking)))
        up, down = top / speeding, top / braking
        level = (far - 0.5 * top * (up + down)) / top
        left = up + level + down - time
        going = 0.5 * speeding * np.clip(time, 0.0, up) ** 2 + top * np.clip(time - up, 0.0, level)
        steps = np.where(time < up + level, going, far - 0.5 * braking * np.clip(left, 0.0, down) ** 2)
        return np.asarray(math.copysign(1.0, self.distance) * steps)

    def began(self, time: Array, steps: Array) -> float:
        """When it began [s], by the steps made (n,) at times (n,) [s], the first of them where it was asked for."""

        def misfit(begin: float) -> float:
            return float(np.sum((self.course(time - begin) - steps) ** 2))

        bounds = float(time[0]) - _EARLY, float(time[0]) + _LATE
        return float(minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-5}).x)


# Seconds between two samples of the model's course.
_STEP = 1e-3
# Time constant [s] of the slow part. Without one an age comes out 2 to 3 ms too large on the emulated rig, 5 where
# sheaths rub, and off by 6 to 8 where one plane is half as stiff as the other; half or twice as long a time changes 1.
_SLOW = 0.15
# Delay [s] beyond which nothing is looked for.
_LATEST = 0.5
# Delays [s] and natural frequencies [rad/s] of which the best begins the fit.
_DELAYS, _RATES, _DAMPING = np.arange(0.0, 0.4, 0.02).tolist(), (15.0, 30.0, 60.0, 120.0), 0.5


class MotorStroke(NamedTuple):
    """One stroke of the motor: positions (n,) [steps] at times (n,) [s], and angles (m,) [rad] stamped (m,) [s]."""

    time: Array
    position: Array
    stamped: Array
    angle: Array


class Latency(NamedTuple):
    """Latency of a camera, estimated from strokes."""

    delay: float
    """From the middle of an exposure to its time stamp [s]."""
    sd: float
    """Standard deviation of that [s], by the fit's residuals."""
    rate: float
    """The wrist's natural frequency on this tendon [rad/s]."""
    scatter: float
    """Standard deviation of the angles about the fit [rad]."""
    pictures: int


def find_latency(strokes: Sequence[MotorStroke], meanwhile: Callable[[], None] = lambda: None) -> Latency:
    """The delay by which strokes were seen. ValueError for fewer than twenty pictures.

    It takes up to seconds, and calls `meanwhile` some hundred times a second.
    """
    count = sum(len(stroke.angle) for stroke in strokes)
    if count < 20:
        raise ValueError(f"{count} pictures are too few")

    def fitted(begin: Array, parts: int) -> OptimizeResult:
        def errors(x: Array) -> Array:
            meanwhile()
            return _errors(strokes, _courses(strokes, float(np.exp(x[1])), float(np.exp(x[2]))), float(x[0]), parts)

        bounds = [-0.05, np.log(3.0), np.log(0.02)], [_LATEST, np.log(1000.0), np.log(20.0)]
        return least_squares(errors, begin, bounds=bounds, x_scale=[1e-3, 0.1, 0.1])

    tried = []
    for rate in _RATES:
        courses = _courses(strokes, rate, _DAMPING)
        meanwhile()
        tried += [(float(np.sum(_errors(strokes, courses, delay, 1) ** 2)), delay, rate) for delay in _DELAYS]
    _, begin, rate = min(tried)
    swing = fitted(np.array([begin, np.log(rate), np.log(_DAMPING)]), 1)  # alone, lest it be taken for the slow part
    fit = fitted(swing.x, 2)
    free = max(1, count - len(strokes) - 5)
    variance = 2.0 * float(fit.cost) / free
    slope = np.asarray(fit.jac, np.float64)
    covariance = variance * np.linalg.pinv(slope.T @ slope)
    delay, rate = float(fit.x[0]), float(np.exp(fit.x[1]))
    return Latency(delay, float(np.sqrt(covariance[0, 0])), rate, float(np.sqrt(variance)), count)


class _Course(NamedTuple):
    """Response of the model to a stroke from rest at times (n,) [s], and its slow part, (n,) each."""

    time: Array
    parts: tuple[Array, Array]


def _errors(strokes: Sequence[MotorStroke], courses: Sequence[_Course], delay: float, parts: int) -> Array:
    """Angles less the model's first parts; each stroke has its own angle to begin from, all have one gain of each."""
    measured, shown = [], []
    for stroke, course in zip(strokes, courses, strict=True):
        model = np.array([np.interp(stroke.stamped - delay, course.time, part) for part in course.parts[:parts]]).T
        measured.append(stroke.angle - stroke.angle.mean())
        shown.append(model - model.mean(axis=0))
    angle, model = np.concatenate(measured), np.concatenate(shown)
    gains: Array = np.linalg.lstsq(model, angle, rcond=1e-9)[0]
    return angle - model @ gains


def _courses(strokes: Sequence[MotorStroke], rate: float, damping: float) -> list[_Course]:
    swing = bilinear([rate**2], [1.0, 2.0 * damping * rate, rate**2], 1.0 / _STEP)
    slow = bilinear([1.0], [_SLOW, 1.0], 1.0 / _STEP)
    courses = []
    for stroke in strokes:
        time = np.arange(stroke.time[0], stroke.time[-1], _STEP)
        answer = lfilter(*swing, np.interp(time, stroke.time, stroke.position) - stroke.position[0])
        courses.append(_Course(time, (answer, lfilter(*slow, answer))))
    return courses


# Strokes after which one may know enough; that are made at most.
COUNT, MOST = 24, 96
# Bend [rad], in the plane that bends most, between which strokes go, the tendon and those opposite taut at both ends,
# which keeps the wrist linear: at 3.5 deg they pull some 30 N against each other, at 6 deg 56 N, more than motors at
# 1 A hold; how much tendon [m] they reel in at most, and how fast [m/s].
_BEGUN, _ENDED, _LONGEST, _SPEED = math.radians(1.5), math.radians(3.5), 6e-3, 40e-3
# Seconds between two points of a stroke's course.
_SAMPLED = 1e-3
# Bend [rad] at which the tendon counts as taut; at which strokes end.
_TAKEN_UP, _FURTHEST = math.radians(1.0), math.radians(12.0)
# Tendon [m] taken up by one move, and the pause [s] after it.
_MOVE, _REST = 0.12e-3, 0.15
# Seconds for which a stroke is watched before and after it begins; for the way back, and up to where it begins.
_BEFORE, _AFTER, _BACK, _SETTLED = 0.15, 0.35, 0.4, 0.8
# Seconds of silence that the board bears: moves end at their goals, whatever becomes of this computer.
_SILENCE = 0.5
# Bytes of a STATUS; seconds from the last of them until the board's positions are read, by the firmware's cycles.
_STATUS_BYTES, _READ = 7, 0.08e-3


class RigStrokes:
    """Strokes of one axis, which bends the wrist by `furthest` [rad] at most.

    The board is enabled, and where the motors stand is called zero: no homing outlives this. In two planes both
    cameras watch, and readings of the straight wrist are taken off their angles.
    """

    def __init__(
        self, board: Board, tracking: Tracking, settings: RigSettings, axis: int, furthest: float = _FURTHEST
    ) -> None:
        self._furthest, self._taut = furthest, min(_TAKEN_UP, 0.5 * furthest)
        self._board, self._tracking, self._axis = board, tracking, axis
        self._underway = underway(_STATUS_BYTES, settings.baud) + _READ
        self._step, self._ramp, self._slack = (
            settings.actuator.step_length,
            settings.actuator.ramp,
            settings.homing.slack,
        )
        patient = settings.safety.model_copy(update={"watchdog": max(_SILENCE, settings.safety.watchdog)})
        prepare(board, settings.model_copy(update={"safety": patient}))
        board.home()
        self._fed = -math.inf
        if settings.planes == 2:  # what one camera sees of a bend depends on the other
            tracking.zero = Patience(board).markers(tracking, 10)
        self._straight = Patience(board).reading(tracking, 10)

    def strokes(
        self, taut: int, progress: Callable[[int], None] = lambda count: None
    ) -> Iterator[Sequence[Sequence[MotorStroke]]]:
        """All strokes so far as each camera saw them, whenever COUNT more are done, up to MOST; the tendon stays taut.

        They begin from the position [steps] of `taken_up`. Who looks at them calls `hold` all the while. Raises
        SafetyStop, BoardError and CameraError.
        """
        sense = 1 if taut > 0 else -1
        low, _ = self._crept(taut, sense, _BEGUN, _LONGEST)
        high, _ = self._crept(low, sense, _ENDED, _LONGEST)
        cameras, rng = [list[MotorStroke]() for _ in self._tracking.zero], np.random.default_rng(0)
        for count in range(1, MOST + 1):
            self._watch(0, JOG_RATE, _BACK)  # slack: friction is to hold back already when the stroke begins
            self._watch(low, JOG_RATE, _SETTLED)
            # at random, so that strokes begin anywhere between two pictures
            for strokes, stroke in zip(cameras, self._stroke(low, high, _BEFORE * rng.uniform(0.6, 1.4)), strict=True):
                strokes.append(stroke)
            progress(count)
            if count % COUNT == 0:
                yield cameras

    def hold(self) -> None:
        """Keep the motors where they are, when called five times or more in the board's time of silence."""
        if (now := self._board.transport.now()) - self._fed > 0.2 * _SILENCE:
            self._board.ping()
            self._fed = now

    def let_go(self) -> None:
        """Back to where the motor stood at first."""
        self._board.go_to((0,) * AXES, JOG_RATE)

    def taken_up(self) -> tuple[int, Bend]:
        """The position [steps] at which the tendon bends the wrist a little, and the bend, in one plane by its angle.

        The position's sign is the motor's sense. Raises SafetyStop where the tendon bends nothing.
        """
        for sense in (1, -1):
            position, bend = self._crept(0, sense, self._taut, self._slack)
            if _largest(bend) > self._taut:
                return position, bend
            self._watch(0, JOG_RATE, _REST)
        problem = f"axis {self._axis} does not bend the wrist within {1e3 * self._slack:g} mm"
        fix = f"take its slack up: wristctl hw tension --axis {self._axis}; see its tendon, its power, homing.slack"
        raise SafetyStop(problem, "one axis alone", fix)

    def _crept(self, begin: int, sense: int, wanted: float, most: float) -> tuple[int, Bend]:
        """Reel in slowly, by `most` [m] at most, to a bend of `wanted` [rad] in a plane; position [steps] and bend."""
        move = max(1, round(_MOVE / self._step))
        for reeled in range(move, round(most / self._step) + move, move):
            self._watch(begin + sense * reeled, JOG_RATE, _REST)
            if _largest(bend := self._bend()) > wanted:
                break
        return begin + sense * reeled, bend

    def _bend(self) -> Bend:
        reading = Patience(self._board).reading(self._tracking, 3)
        bend = Bend(reading.theta - self._straight.theta, reading.beside - self._straight.beside)
        if bend.askew > self._furthest:
            problem = f"axis {self._axis} bent the wrist by {math.degrees(bend.askew):.1f} deg"
            raise SafetyStop(problem, fix="slacken all tendons")
        return bend

    def _stroke(self, low: int, high: int, before: float) -> list[MotorStroke]:
        move = RampedMove(high - low, round(_SPEED / self._step), self._ramp)
        still, moved = self._watch(low, JOG_RATE, before), self._watch(high, round(move.rate), _AFTER)
        seen = np.concatenate([still[1], moved[1]])
        time = np.arange(still[0][0, 0], moved[0][-1, 0], _SAMPLED)
        answered, steps = moved[0].T
        position = low + move.course(time - move.began(answered, steps - low))
        straight, strokes, furthest = (self._straight.theta, self._straight.beside), list[MotorStroke](), list[float]()
        for plane in range(len(self._tracking.zero)):
            stamped, angle, _ = seen[seen[:, 2] == plane].T
            furthest.append(float(np.abs(angle - straight[plane]).max(initial=0.0)))
            strokes.append(MotorStroke(time, position, stamped, angle))
        if math.hypot(*furthest) > self._furthest:
            raise SafetyStop(f"a stroke of axis {self._axis} bends the wrist too far", fix="slacken all tendons")
        return strokes

    def _watch(self, goal: int, rate: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Go to `goal` and watch, so long and until it is there: positions (n, 2) after their times, and (m, 3) times,
        angles and their planes."""
        board, clock = self._board, self._board.transport
        one, two, three, four = (goal * (k == self._axis) for k in range(AXES))
        board.send(Target((one, two, three, four), (rate,) * 4))
        self._fed = clock.now()
        end, positions, angles = self._fed + seconds, [], []
        moving = True
        while (now := clock.now()) < end or moving:
            status = board.read()
            if status.state is not State.ENABLED:
                raise board.faulted(status)
            moving = Flag.MOVING in status.flags
            positions.append((now + self._underway, status.position[self._axis]))
            self.hold()
            usable = [sighting for sighting in self._tracking.look() if math.isfinite(sighting.theta)]
            angles += [(sighting.time, sighting.theta, sighting.plane) for sighting in usable]
            clock.wait(1e-3)
        return np.array(positions, float).reshape(-1, 2), np.array(angles, float).reshape(-1, 3)


def _largest(bend: Bend) -> float:
    return max(abs(bend.theta), abs(bend.away) if math.isfinite(bend.away) else 0.0)


class AxisTried(NamedTuple):
    """Result of trying one motor."""

    sense: int
    """1 where positive steps reel in, -1 where they pay out."""
    taken_up: float
    """Tendon [m] until the wrist bent by half of what it may."""
    bend: Bend
    """Bend of the wrist then, + as the markers count."""


def axis_tried(testbed: Testbed, settings: CalibrateWristSettings, wrist: WristParameters, axis: int) -> AxisTried:
    """Try an axis, let its tendon go again, and release the drives. Closes the testbed.

    Raises SafetyStop where it bends the wrist too far, not at all, or as another tendon would; BoardError and
    CameraError.
    """
    with in_sight(testbed, settings, wrist) as (board, _, tracking):
        strokes = RigStrokes(board, tracking, settings, axis, math.radians(settings.max_deg))
        steps, bend = strokes.taken_up()
        strokes.let_go()
        ExpectedMoves(settings, wrist, settings.plane).judge_side(axis, bend)
    return AxisTried(1 if steps > 0 else -1, abs(steps) * settings.actuator.step_length, bend)
