"""The observer that all controllers share where a camera measures: a Kalman filter on the one-segment model.

Its state is x = (theta, rate, d), d a load torque that walks at random: it takes up wrong stiffness and payload, which
would otherwise stay as an error. A frame is fused at its capture time; from there the filter predicts forward with
what the motors have delivered since. The gain is the stationary one for the frame rate.
"""

from typing import Any, NamedTuple

from wristctl.control.model import one_segment
from wristctl.control.response import Estimate
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import frictionless_pulls, tendon_stiffness
from wristctl.wrist.tendons import torque_of

_ONE = (0,)


class Observer(NamedTuple):
    """One block's estimates: gain (3,), what was delivered (ring, 2), and x (3,), each with its lanes.

    `fused` is x at the last fused frame, at each lane's tick `at` (1,); `now` is x at the present tick.
    """

    gain: Any
    delivered: Any
    fused: Any
    now: Any
    at: Any


class Schedule(NamedTuple):
    """One block's ticks at which frames are taken, (F, lanes), and how many ticks later they arrive, and are believed
    to arrive, (lanes,) each; where a lane has fewer frames than another, the rest are never taken."""

    captures: Any
    late: Any
    believed: Any

    @property
    def arrivals(self) -> Any:
        """Ticks at which frames arrive, (F, lanes)."""
        return self.captures + self.late

    @property
    def dated(self) -> Any:
        """Ticks at which the observer believes that they were taken, (F, lanes)."""
        return (self.arrivals - self.believed).clip(0)


class ArrivingFrame(NamedTuple):
    """An angle, and whether it is `seen` (1, not 0), taken `since` [s] after tick `captured`, negative in lanes in
    which none arrives."""

    captured: Any
    since: Any
    angle: Any
    seen: Any


class NoCamera(NamedTuple):
    """Sensors are ideal: in place of a Watch and of its Schedule."""


class Watch(NamedTuple):
    """One block's camera: what is added to each frame and whether it is seen (F, 2), pictures taken (F,), each lane's
    next frame to take and to arrive, `turn` (2, lanes); rows (3,) to work on, and the observer behind it."""

    readings: Any
    pictures: Any
    turn: Any
    arriving: Any
    observer: Any


@compiled
def propagate(drive: Any, believed: Any, x: Any, plus: Any, minus: Any, h: Any) -> None:
    """Advance x by one control period h [s], linearly implicit in damping and stiffness; where h is 0, x stays."""
    theta = part(x, 0, _ONE)
    angle, speed, load = x[0], x[1], x[2]
    pull_plus, pull_minus = frictionless_pulls(drive, believed, theta, plus, minus)
    inertia, resisting = one_segment(believed, angle, speed)
    stiffness = believed.stiffness + tendon_stiffness(drive, believed, angle)
    push = torque_of(angle, believed, pull_plus, pull_minus) + load - resisting - h * stiffness * speed
    speed = speed + h * push / (inertia + h * believed.damping + h * h * stiffness)
    x[0] = angle + h * speed
    x[1] = speed


@compiled
def sample(watch: Any, schedule: Any, drive: Any, believed: Any, tick: int, angle: Any, h: float) -> None:
    """Take a frame of the true angle in lanes where one is due, and fuse those that arrive at this tick."""
    turn = watch.turn
    frames, lanes = schedule.captures.shape
    readings, pictures = watch.readings.reshape(frames, 2, lanes), watch.pictures.reshape(frames, lanes)
    rows, arriving = rows_of(watch.arriving), watch.arriving.reshape(3, lanes)
    newest = watch.observer.at.reshape(lanes)
    rows[1] = angle
    begin, first, last = tick, tick, -1
    for lane in range(lanes):
        taken, arrived = turn[0, lane], turn[1, lane]
        if taken < frames and schedule.captures[taken, lane] == tick:
            pictures[taken, lane] = arriving[1, lane] + readings[taken, 0, lane]
            taken += 1
            turn[0, lane] = taken
        arriving[0, lane] = -1.0
        if arrived < taken and schedule.captures[arrived, lane] + schedule.late[lane] == tick:
            captured = max(tick - schedule.believed[lane], 0)
            begin, first, last = min(begin, int(newest[lane])), min(first, captured), max(last, captured)
            arriving[0, lane] = captured
            arriving[1, lane] = pictures[arrived, lane]
            arriving[2, lane] = readings[arrived, 1, lane]
            turn[1, lane] = arrived + 1
    if last >= 0:
        fuse(
            watch.observer,
            drive,
            believed,
            (begin, first, last, tick),
            ArrivingFrame(rows[0], 0.0, rows[1], rows[2]),
            h,
        )


@by_type
def sense(watch: Any, schedule: Any, drive: Any, believed: Any, tick: int, angle: Any, rate: Any, h: float) -> Any:
    """Estimate that the law sees: angle and rate as they are, or, behind a camera, as the observer has them."""
    raise NotImplementedError("compiled code only")


@implements(sense, NoCamera)
def _as_it_is(watch: Any, schedule: Any, drive: Any, believed: Any, tick: int, angle: Any, rate: Any, h: float) -> Any:
    return Estimate(angle, rate, zero_like(angle))


@implements(sense, Watch)
def _observed(watch: Any, schedule: Any, drive: Any, believed: Any, tick: int, angle: Any, rate: Any, h: float) -> Any:
    sample(watch, schedule, drive, believed, tick, angle, h)
    now = rows_of(watch.observer.now)
    return Estimate(now[0], now[1], now[2])


@compiled
def fuse(observer: Any, drive: Any, believed: Any, ticks: Any, frame: Any, h: float) -> None:
    """Fuse a frame in the lanes in which one arrives, and predict from there to the present tick.

    `ticks` are, of these lanes, the first that was fused before, the first and the last that are captured now, and the
    present one. What was delivered at every tick from the first one on must still be in the ring.
    """
    begin, first, last, tick = ticks
    size = observer.delivered.shape[0]
    gain, fused, now, newest = (
        rows_of(observer.gain),
        rows_of(observer.fused),
        rows_of(observer.now),
        rows_of(observer.at),
    )
    zero = zero_like(believed.length)
    for past in range(begin, last):
        sent = rows_of(observer.delivered[past % size])
        propagate(
            drive, believed, fused, sent[0], sent[1], where((newest[0] <= past) & (frame.captured > past), h, zero)
        )
    arrives = frame.captured >= zero
    innovation = frame.seen * (frame.angle - fused[0] - frame.since * fused[1])
    for i in range(3):
        fresh = fused[i] + gain[i] * innovation
        fused[i] = where(arrives, fresh, fused[i])
        now[i] = where(arrives, fresh, now[i])
    for past in range(first, tick):
        sent = rows_of(observer.delivered[past % size])
        propagate(drive, believed, now, sent[0], sent[1], where(arrives & (frame.captured <= past), h, zero))
    newest[0] = where(arrives, frame.captured, newest[0])


@compiled
def predict(observer: Any, drive: Any, believed: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """Remember what is delivered over this tick and go on over it."""
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    sent[0] = plus
    sent[1] = minus
    propagate(drive, believed, rows_of(observer.now), plus, minus, h)


@by_type
def go_on(watch: Any, drive: Any, believed: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """`predict` behind a camera; nothing where there is none."""
    raise NotImplementedError("compiled code only")


@implements(go_on, NoCamera)
def _nothing(watch: Any, drive: Any, believed: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    pass


@implements(go_on, Watch)
def _predict(watch: Any, drive: Any, believed: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    predict(watch.observer, drive, believed, tick, plus, minus, h)
