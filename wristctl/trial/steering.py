"""The controller on hardware: the same compiled law, allocation and observer as in simulation, tick by tick."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.faults import Faults
from wristctl.config.bench import InjectedFault
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Limits
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.control.response import Controlled, Estimate, Seen, look_ahead, respond, room_like
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.observer import ArrivingFrame, fuse, knowing_in_lanes, known_of_sides, predict
from wristctl.simulation.stationary_filter import Belief, observer_of
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Ticks that a frame may be late.
REMEMBERED = 256


class Answer(NamedTuple):
    """Answer of the law: torques wanted and commanded [N m], tensions of one tendon of each side [N]."""

    torque_wanted: float
    torque: float
    plus: float
    minus: float
    saturated: bool


class Steering:
    """Observer and law of one bending plane. Ticks are numbered from 0, `period` [s] apart."""

    def __init__(self, wrist: WristParameters, actuator: Actuator, sensor: Sensor, period: float, theta: float) -> None:
        self._known = known_of_sides(wrist, actuator)
        self._bounds = TENDONS_PER_SIDE * np.repeat([wrist.pretension, wrist.tension_limit], 2)
        self._observer = observer_of(Belief(sensor, actuator, wrist, period), REMEMBERED, theta)
        self._signals, self._target, self._found = np.zeros((1, 0)), np.zeros((1, len(REFERENCE))), np.zeros(6)
        self._period = period
        self._law: Any = None
        self._preview = 0
        self._gains, self._memory = np.zeros(1), np.zeros((1, 1))
        self.tick = 0
        self.withheld = 0.0
        """Torque of the last command that the motors are too slow to deliver [N m]."""

    @property
    def estimate(self) -> Estimate:
        """As of the present tick."""
        theta, rate, load = self._observer.now
        return Estimate(float(theta), float(rate), float(load))

    def use(self, controller: Controller, gains: Sequence[float]) -> None:
        """Take up a law, its memory empty, with motors that have caught up."""
        self.withheld = 0.0
        self._law = controller.compiled()
        self._signals = np.zeros((1, signals_of(controller.preview)))
        self._preview = controller.preview
        self._gains = np.array([*gains, 0.0])
        self._memory = np.zeros((1, max(1, controller.memory)))

    def see(self, theta: float, captured: float) -> bool:
        """Fuse an angle [rad] seen `captured` seconds after tick 0; False where that is too old or yet to come."""
        tick = math.floor(captured / self._period)
        if not max(int(self._observer.at[0]), self.tick - REMEMBERED + 1) <= tick <= self.tick:
            return False
        since = captured - tick * self._period
        ticks = int(self._observer.at[0]), tick, tick, self.tick
        _fuse(self._observer, self._known, ticks, since, theta, self._period)
        return True

    def respond(self, course: Array, tick: int = 0) -> Answer:
        """The law's answer, at the present estimate, to a reference (T, 3) of angle, rate and acceleration at its tick.

        It goes by periods; beyond its end it stays as it is there, for a law that looks ahead. Raises what a plain law
        has raised.
        """
        models = self._known.belief.models
        control = Controlled(self._law, self._signals, models, self._gains, self._memory, self._target)
        seen, to_follow = np.array([*self._observer.now, self.withheld, 0.0]), (course, tick, self._preview)
        _respond(control, self._known, self._bounds, seen, to_follow, self._period, self._found)
        self._law.check()
        wanted, torque, plus, minus, low, high = map(float, self._found)
        return Answer(wanted, torque, plus / TENDONS_PER_SIDE, minus / TENDONS_PER_SIDE, not low <= wanted <= high)

    def predict(self, reeled_plus: float, reeled_minus: float) -> None:
        """Go on to the next tick, with the sides reeled in by so much [m] until then."""
        _predict(self._observer, self._known, self.tick, np.array([reeled_plus, reeled_minus], float), self._period)
        self.tick += 1


@kernel
def _respond(control: Any, known: Any, bounds: Any, sees: Any, to_follow: Any, period: float, result: Any) -> None:
    knowing, row, x, bound = knowing_in_lanes(known), rows_of(result), rows_of(sees), rows_of(bounds)
    bend, pulls = knowing.bend, lanes_like(knowing.pulls)
    course, tick, preview = to_follow
    for ahead in range(preview, -1, -1):  # the present last: it is what the law follows
        control.reference[0, :] = course[min(tick + ahead, course.shape[0] - 1)]
        if ahead > 0:
            look_ahead(control, bend, ahead, 0.0)
    seen = Seen(part(x, 0, (0, 0, 0)), part(x, 3, (0,)), part(x, 4, (0,)))
    limits, room = Limits(part(bound, 0, known.pulls), part(bound, 2, known.pulls)), room_like(bend, knowing.arms)
    respond(control, knowing.belief, seen, limits, room, 0.0, period, pulls)
    row[0] = room.wanted[0]
    row[1] = room.torque[0]
    row[2] = pulls[0]
    row[3] = pulls[1]
    row[4] = room.low[0]
    row[5] = room.high[0]


@kernel
def _fuse(observer: Any, known: Any, ticks: Any, since: float, theta: float, h: float) -> None:
    knowing = knowing_in_lanes(known)
    bend, zero = lanes_like(knowing.bend), zero_like(knowing.bend[0])
    bend[0] = theta + zero
    fuse(observer, knowing, ticks, ArrivingFrame(ticks[1] + zero, since, bend, 1.0 + zero), h)


@kernel
def _predict(observer: Any, known: Any, tick: int, reeled: Any, h: float) -> None:
    predict(observer, knowing_in_lanes(known), tick, part(rows_of(reeled), 0, known.pulls), h)


class HostFaults:
    """Faults of the bench that happen in the control loop; times count from the trial's motion."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        self._faults = Faults(faults)
        self._faults.begin(0.0)

    def answer(self, answer: Any, time: float) -> Any:
        """The law's answer, in any planes; NaN under model-nan. Raises ArithmeticError under controller-exception."""
        if self._faults.on("controller-exception", time):
            raise ArithmeticError("injected fault")
        return answer._replace(torque_wanted=math.nan) if self._faults.on("model-nan", time) else answer

    def disk(self, time: float) -> bool:
        """Whether the disk is full."""
        return self._faults.on("disk-full", time)
