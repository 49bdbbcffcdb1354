"""The observer that all controllers share where a camera measures: a Kalman filter on the one-segment model.

Its state is x = (bend, rate, d) for each of P planes, d a load torque that walks at random: it takes up wrong stiffness
and payload, which would otherwise stay as an error. A frame shows the bends of all planes or none, and is fused at its
capture time; from there the filter predicts forward with what the motors have delivered since. The gain is the
stationary one for the frame rate, of each plane by itself.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Sides, belief_in_lanes, coupling, moment_arms_at
from wristctl.control.model import one_segment
from wristctl.control.response import OF_A_PLANE
from wristctl.lanes.compiled import by_type, compiled, implements, nothing, spelled_out
from wristctl.lanes.lane import rounded, where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_at, rows_of
from wristctl.simulation.actuator import frictionless_pulls, held_stiffness
from wristctl.simulation.simulated_drives import SIDES, drive_in_lanes, drive_of
from wristctl.wrist.segments import load_segments, segments


class Observer(NamedTuple):
    """One block's estimates: gain (3 P,), what was delivered (ring, T), and x (3 P,), each with its lanes.

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
    """Bends (P rows), and whether they are `seen` (1, not 0), taken `since` [s] after tick `captured`, negative in
    lanes in which none arrives."""

    captured: Any
    since: Any
    bend: Any
    seen: Any


class NoCamera(NamedTuple):
    """Sensors are ideal: in place of a Watch and of its Schedule."""


class Watch(NamedTuple):
    """One block's camera: what is added to each frame's bends and whether it is seen (F, P + 1), pictures taken (F, P),
    each lane's next frame to take and to arrive, `turn` (2, lanes); rows (P + 3,) to work on, of which the last stays:
    by how much later than at its tick a frame is dated [s]; and the observer."""

    readings: Any
    pictures: Any
    turn: Any
    arriving: Any
    observer: Any


class Knowing(NamedTuple):
    """Belief of the controller's side and its drive, and rows as long as those of bends, pulls and moment arms; of one
    loop's arrays tuples with an entry for each plane, place and arm."""

    belief: Any
    drive: Any
    bend: Any
    pulls: Any
    arms: Any


def known_of_sides(wrist: WristParameters, actuator: Actuator, alike: ArrayLike = SIDES) -> Knowing:
    """Knowledge of a controller's side in one plane, with so many tendons alike on either side (2,)."""
    counts = np.array(alike, float)
    return Knowing(Sides(segments(wrist, 1)[None], counts), drive_of(actuator, counts), (0,), (0, 0), (0, 0))


@spelled_out
def knowing_in_lanes(known: Any) -> Any:
    """Knowing from one loop's arrays; it lives as long as its caller."""
    rows = rows_at(known.belief.models, 0)
    bend, pulls, arms = part(rows, 0, known.bend), part(rows, 0, known.pulls), part(rows, 0, known.arms)
    return Knowing(belief_in_lanes(known.belief), drive_in_lanes(known.drive), bend, pulls, arms)


@compiled
def propagate(knowing: Any, x: Any, counts: Any, h: Any) -> None:
    """Advance x by one control period h [s], linearly implicit in damping and stiffness; where h is 0, x stays."""
    known, drive = knowing.belief, knowing.drive
    bend, rate, still, extra = (
        lanes_like(knowing.bend), lanes_like(knowing.bend), lanes_like(knowing.bend), lanes_like(knowing.bend),
    )  # fmt: skip
    pulls, arms = lanes_like(knowing.pulls), lanes_like(knowing.arms)
    zero, count = zero_like(x[0]), len(pulls)
    for p in range(len(bend)):
        bend[p], rate[p], still[p] = x[OF_A_PLANE * p], x[OF_A_PLANE * p + 1], zero
    frictionless_pulls(drive, known, bend, counts, pulls)
    moment_arms_at(known.wrist, bend, arms)
    coupling(known.coupling, known, bend, rate, still, extra)
    for p in range(len(bend)):
        torque, square = zero, zero
        for back in range(count):
            t = count - 1 - back
            arm = arms[count * p + t]
            torque = torque + arm * pulls[t]
            square = square + (known.alike[t] * arm) * arm
        angle, speed, load = bend[p], rate[p], x[OF_A_PLANE * p + 2]
        model = load_segments(rows_at(known.models, p))
        inertia, resisting = one_segment(model, angle, speed)
        stiffness = model.stiffness + rounded(held_stiffness(drive, zero) * square)
        push = torque + load - extra[p] - resisting - h * stiffness * speed
        speed = speed + h * push / (inertia + h * model.damping + h * h * stiffness)
        x[OF_A_PLANE * p] = angle + h * speed
        x[OF_A_PLANE * p + 1] = speed


@compiled
def _sample(watch: Any, schedule: Any, knowing: Any, tick: int, bend: Any, h: float) -> None:
    """Take a frame of the true bends in lanes where one is due, and fuse those that arrive at this tick."""
    turn, planes = watch.turn, len(bend)
    frames, lanes = schedule.captures.shape
    readings = watch.readings.reshape(frames, planes + 1, lanes)
    pictures = watch.pictures.reshape(frames, planes, lanes)
    rows, arriving = rows_of(watch.arriving), watch.arriving.reshape(planes + 3, lanes)
    newest = watch.observer.at.reshape(lanes)
    shown = lanes_like(bend)
    for p in range(planes):
        rows[2 + p] = bend[p]
    begin, first, last = tick, tick, -1
    for lane in range(lanes):
        taken, arrived = turn[0, lane], turn[1, lane]
        if taken < frames and schedule.captures[taken, lane] == tick:
            for p in range(planes):
                pictures[taken, p, lane] = arriving[2 + p, lane] + readings[taken, p, lane]
            taken += 1
            turn[0, lane] = taken
        arriving[0, lane] = -1.0
        if arrived < taken and schedule.captures[arrived, lane] + schedule.late[lane] == tick:
            captured = max(tick - schedule.believed[lane], 0)
            begin, first, last = min(begin, int(newest[lane])), min(first, captured), max(last, captured)
            arriving[0, lane] = captured
            arriving[1, lane] = readings[arrived, planes, lane]
            for p in range(planes):
                arriving[2 + p, lane] = pictures[arrived, p, lane]
            turn[1, lane] = arrived + 1
    if last >= 0:
        for p in range(planes):
            shown[p] = rows[2 + p]
        frame = ArrivingFrame(rows[0], rows[2 + planes], shown, rows[1])
        fuse(watch.observer, knowing, (begin, first, last, tick), frame, h)


@by_type
def sense(watch: Any, schedule: Any, knowing: Any, tick: int, bend: Any, rate: Any, h: float, seen: Any) -> None:
    """Write what the law sees (3 P rows): bends and rates as they are, or, behind a camera, as the observer has them
    with the load."""


@implements(sense, NoCamera)
def _as_it_is(watch: Any, schedule: Any, knowing: Any, tick: int, bend: Any, rate: Any, h: float, seen: Any) -> None:
    for p in range(len(bend)):
        seen[OF_A_PLANE * p], seen[OF_A_PLANE * p + 1] = bend[p], rate[p]
        seen[OF_A_PLANE * p + 2] = zero_like(bend[p])


@implements(sense, Watch)
def _observed(watch: Any, schedule: Any, knowing: Any, tick: int, bend: Any, rate: Any, h: float, seen: Any) -> None:
    _sample(watch, schedule, knowing, tick, bend, h)
    now = rows_of(watch.observer.now)
    for i in range(len(seen)):
        seen[i] = now[i]


@compiled
def _recall(row: Any, counts: Any) -> None:
    before = rows_of(row)
    for t in range(len(counts)):
        counts[t] = before[t]


@compiled
def fuse(observer: Any, knowing: Any, ticks: Any, frame: Any, h: float) -> None:
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
    sent, zero = lanes_like(knowing.pulls), zero_like(gain[0])
    for past in range(begin, last):
        _recall(observer.delivered[past % size], sent)
        propagate(knowing, fused, sent, where((newest[0] <= past) & (frame.captured > past), h, zero))
    arrives = frame.captured >= zero
    for p in range(len(frame.bend)):
        first_row = OF_A_PLANE * p
        innovation = frame.seen * (frame.bend[p] - fused[first_row] - frame.since * fused[first_row + 1])
        for i in range(first_row, first_row + OF_A_PLANE):
            fresh = fused[i] + gain[i] * innovation
            fused[i] = where(arrives, fresh, fused[i])
            now[i] = where(arrives, fresh, now[i])
    for past in range(first, tick):
        _recall(observer.delivered[past % size], sent)
        propagate(knowing, now, sent, where(arrives & (frame.captured <= past), h, zero))
    newest[0] = where(arrives, frame.captured, newest[0])


@compiled
def predict(observer: Any, knowing: Any, tick: int, counts: Any, h: float) -> None:
    """Remember what is delivered over this tick and go on over it."""
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    for t in range(len(counts)):
        sent[t] = counts[t]
    propagate(knowing, rows_of(observer.now), counts, h)


@by_type
def go_on(watch: Any, knowing: Any, tick: int, counts: Any, h: float) -> None:
    """`predict` behind a camera; nothing where there is none."""


implements(go_on, NoCamera)(nothing)


@implements(go_on, Watch)
def _predict(watch: Any, knowing: Any, tick: int, counts: Any, h: float) -> None:
    predict(watch.observer, knowing, tick, counts, h)
