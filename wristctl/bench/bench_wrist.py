"""The wrist that hangs on the emulated board, and what it has done."""

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.bench.faults import Faults, MotorFaults
from wristctl.bench.loads import Load, PlanarLoad, SpatialLoad
from wristctl.bench.motors import CYCLES, PERIOD, Stepper, spool_state_of, stepper_of
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES
from wristctl.config.bench import BenchSettings
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy

# Ports whose pins turn motors.
_MOTOR_PORTS = ord("A"), ord("C")
# Periods that are remembered at least.
_KEPT = 60_000


class Truth(NamedTuple):
    """True motion of a wrist, once a millisecond."""

    time: Array
    """(T,) [s] on the board's clock"""
    theta: Array
    """(T, q) the plant's coordinates: segment angles [rad], in two planes toward ulnar and flexion by turns"""
    angle: Array
    """(T,) of the last disc [rad], in two planes its bends (T, 2)"""
    rate: Array
    """(T, q) [rad/s]"""
    pull: Array
    """(T, M) at their spools [N], of the tendons that motors wind, in the order of the axes, when the millisecond that
    ends then began"""
    reeled: Array
    """(T, M) tendon on the spools [m] in the middle of that millisecond, 0 where it is taut without pulling on the
    straight wrist"""
    across: Array
    """(T,) [rad] bend across the plane, away from the camera, when the millisecond ended; in two planes 0"""


class MotorMotion(NamedTuple):
    """Motion of the motors as the board commanded it, axis by axis."""

    steps: tuple[int, ...]
    """microsteps that reeled in, less those that paid out, since power-on"""
    last_step: tuple[float | None, ...]
    """[s] on the board's clock; None: never"""
    energised: tuple[bool, ...]


class BenchWrist:
    """Straight and at rest at power-on, facing ulnar; it follows the board's pins in whole milliseconds.

    `stream` draws what the settings leave to chance of the plant: a bench has one wrist for as long as it stands. It
    bends in one plane at a time, before a camera that sees theta > 0 on its `positive` side, or in two `planes`.
    """

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy = (0,), faults: Faults | None = None,
        positive: Literal["right", "left"] = "right", planes: Literal[1, 2] = 1,
    ) -> None:  # fmt: skip
        self._faults = MotorFaults(faults or Faults(()), settings.motors.order)
        self._stepper, self._spools = stepper_of(settings), spool_state_of(settings)
        self._steps = self._spools.step.copy()
        self._load: Load
        if planes == 1:
            self._load = PlanarLoad(settings, wrist, stream, self._spools, positive)
        else:
            self._load = SpatialLoad(settings, wrist, stream, self._spools)
        self._n = self._load.coordinates
        self._edges = self._heard = np.empty((0, 3), np.int64)
        self._periods = self._rows = 0
        self._record = np.empty((2 * _KEPT, 2 * self._n + 2 * AXES + 1))
        self.begin(Disturbances(), math.inf)  # no trial yet: nothing breaks while it is homed

    @property
    def time(self) -> float:
        """Seconds on the board's clock up to which the wrist is known."""
        return self._periods * PERIOD

    @property
    def motion(self) -> MotorMotion:
        """Motion of the motors up to `time`, as the board commanded it."""
        spools = self._spools
        last = tuple(None if cycle < 0 else float(cycle) / FREQUENCY for cycle in spools.stepped)
        return MotorMotion(tuple(map(int, spools.counted)), last, tuple(map(bool, spools.energised)))

    def face(self, direction: str) -> None:
        """Bend in this direction's plane from here on; where that is another plane, at rest at first as it is bent.

        In two planes nothing changes.
        """
        self._load.face(direction, self._spools)

    def begin(self, disturbances: Disturbances, start: float) -> None:
        """A trial: what breaks in it, and these disturbances, count from `start` on the board's clock."""
        self._begun = start
        self.disturb(disturbances, start)

    def disturb(self, disturbances: Disturbances, start: float) -> None:
        """Let these act from here on, in place of others; their times count from `start` on the board's clock."""
        self._disturbances, self._start = disturbances, start

    def hear(self, edges: NDArray[np.void]) -> None:
        """Changes of the chip's output latches, as it gives them: to be followed later, those that turn motors."""
        edges = edges[np.isin(edges["port"], _MOTOR_PORTS)]
        if len(edges):
            columns = [edges[name].astype(np.int64) for name in ("cycle", "port", "value")]
            self._heard = np.concatenate([self._heard, np.stack(columns, axis=1)])

    def follow(self, cycles: int) -> None:
        """Go on to the last whole millisecond of the board's clock; all edges up to there have been heard."""
        self._edges = np.concatenate([self._edges, self._faults.hear(self._heard, cycles)])
        self._heard = self._heard[:0]
        while (count := min(cycles // CYCLES - self._periods, _KEPT)) > 0:
            for axis, slack in self._faults.give_way(self.time):
                self._spools.slack[axis] += slack
                self._spools.reeled[axis] -= slack
            self._rescale(self._faults.rescaled(self.time))
            self._load.carry(self._faults.carried(self.time))
            if (due := self._faults.next(self.time)) < math.inf:
                count = min(count, max(1, math.ceil((due - self.time) / PERIOD - 1e-9)))
            for axis, rate in self._faults.creeping(self.time):
                self._spools.slack[axis] += rate * count * PERIOD
                self._spools.reeled[axis] -= rate * count * PERIOD
            self._make_room(count)
            time = PERIOD * np.arange(self._periods, self._periods + count, dtype=np.float64)
            acting = self._disturbances, time - self._start
            out = self._record[self._rows : self._rows + count]
            heard = self._load.follow(
                self._spools, self._held(), acting, self._edges, self._periods, self._begun, out
            )  # fmt: skip
            self._edges = self._edges[heard:]
            self._rows += count
            self._periods += count

    def _rescale(self, scale: list[float]) -> None:
        """Let each drive make so many times its own way with a step, from where its spool stands."""
        step = self._steps * scale
        self._spools.slack[:] += (step - self._spools.step) * self._spools.counted
        self._spools.step[:] = step

    def _held(self) -> Stepper:
        """The motors, as far as they hold now."""
        holding = min(self._stepper.holding, self._faults.holding(self.time))
        return self._stepper._replace(holding=holding)

    def truth(self, since: float = 0.0) -> Truth:
        """True motion after `since` [s], as far back as the last minute."""
        fresh = max(0, min(self._rows, self._periods - round(since / PERIOD)))
        rows, n = self._record[self._rows - fresh : self._rows].copy(), self._n
        time = PERIOD * np.arange(self._periods - fresh + 1, self._periods + 1, dtype=np.float64)
        theta, rate, pull, reeled, across = np.split(rows, [n, 2 * n, 2 * n + AXES, 2 * n + 2 * AXES], axis=1)
        wound = self._load.wound
        return Truth(time, theta, self._load.bend(theta), rate, pull[:, :wound], reeled[:, :wound], across[:, 0])

    def turned(self, ends: Array) -> float:
        """How far the last disc turns between two places (2, q) [rad]."""
        return self._load.turned(ends)

    def angles(self, times: Array) -> Array:
        """Coordinates (k, q) at k times within what `truth` remembers, straight lines between milliseconds."""
        first = max(0, round((times.min()) / PERIOD) - 2)
        truth = self.truth(first * PERIOD)
        return np.stack([np.interp(times, truth.time, angle) for angle in truth.theta.T], axis=-1)

    def across(self, time: float) -> float:
        """The bend across the plane at a time within what `truth` remembers [rad]."""
        truth = self.truth(max(0.0, time - 2.0 * PERIOD))
        return float(np.interp(time, truth.time, truth.across))

    def _make_room(self, count: int) -> None:
        if self._rows + count > len(self._record):
            self._record[:_KEPT] = self._record[self._rows - _KEPT : self._rows].copy()
            self._rows = _KEPT
