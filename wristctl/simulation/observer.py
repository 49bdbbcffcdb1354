"""The observer that all controllers share where a camera measures: a Kalman filter on the one-segment model.

Its state is x = (theta, rate, d), d a load torque that walks at random: it takes up wrong stiffness and payload, which
would otherwise stay as an error. A frame is fused at its capture time; from there the filter predicts forward with
what the motors have delivered since. The gain is the stationary one for the frame rate.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from wristctl.control.model import one_segment
from wristctl.control.response import Estimate
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import frictionless_pulls, tendon_stiffness
from wristctl.wrist.allocation import torque_of

_ONE = (0,)


class Observer(NamedTuple):
    """One block's estimates: gain (3,), what was delivered (ring, 2), and x (3,), each with its lanes.

    `fused` is x at the last fused frame, at tick `at[0]`; `now` is x at the present tick.
    """

    gain: Any
    delivered: Any
    fused: Any
    now: Any
    at: Any


class Schedule(NamedTuple):
    """Ticks at which frames are taken, at which they arrive, and at which the observer believes that they were taken,
    (F,) each; the same for all lanes."""

    captures: Any
    arrivals: Any
    dated: Any


class Watch(NamedTuple):
    """One block's camera: what is added to each frame and whether it is seen (F, 2), pictures taken (F,), the next
    frame to take and to arrive, `turn`; and the observer behind it."""

    readings: Any
    pictures: Any
    turn: Any
    observer: Any


@compiled
def propagate(drive: Any, known: Any, x: Any, plus: Any, minus: Any, h: float) -> None:
    """Advance x by one control period, linearly implicit in damping and stiffness."""
    theta = part(x, 0, _ONE)
    angle, speed, load = x[0], x[1], x[2]
    pull_plus, pull_minus = frictionless_pulls(drive, known, theta, plus, minus)
    inertia, resisting = one_segment(known, angle, speed)
    stiffness = known.stiffness + 0.0 * angle
    stiffness = stiffness + tendon_stiffness(drive, known, angle)
    push = torque_of(angle, known, pull_plus, pull_minus) + load - resisting - h * stiffness * speed
    speed = speed + h * push / (inertia + h * known.damping + h * h * stiffness)
    x[0] = angle + h * speed
    x[1] = speed


@compiled
def sample(schedule: Any, watch: Any, drive: Any, known: Any, tick: int, angle: Any, h: float) -> None:
    """Take a frame of the true angle where one is due, and fuse the frame that arrives at this tick, if any."""
    turn, readings, pictures = watch.turn, watch.readings, watch.pictures
    taken, arrived = turn[0], turn[1]
    if taken < len(schedule.captures) and schedule.captures[taken] == tick:
        rows_of(pictures)[taken] = angle + rows_of(readings[taken])[0]
        turn[0] = taken + 1
    if arrived < turn[0] and schedule.arrivals[arrived] == tick:
        seen, captured = rows_of(readings[arrived])[1], schedule.dated[arrived]
        fuse(watch.observer, drive, known, (captured, tick), 0.0, rows_of(pictures)[arrived], seen, h)
        turn[1] = arrived + 1


@compiled
def sense(schedule: Any, watch: Any, drive: Any, known: Any, tick: int, angle: Any, rate: Any, h: float) -> Any:
    """Estimate, as the law sees it: angle and rate as they are, or, behind a camera, all as the observer has it."""
    if watch is None:
        return Estimate(angle, rate, 0.0 * angle)
    sample(schedule, watch, drive, known, tick, angle, h)
    now = rows_of(watch.observer.now)
    return Estimate(now[0], now[1], now[2])


@compiled
def fuse(observer: Any, drive: Any, known: Any, ticks: Any, since: float, angle: Any, seen: Any, h: float) -> None:
    """Fuse an angle (where `seen` is 1, not 0) taken `since` [s] after the first of two ticks; predict to the other.

    What was delivered at every tick from the last fused one on must still be in the ring.
    """
    captured, tick = ticks
    size = observer.delivered.shape[0]
    gain, fused, now = rows_of(observer.gain), rows_of(observer.fused), rows_of(observer.now)
    for past in range(observer.at[0], captured):
        sent = rows_of(observer.delivered[past % size])
        propagate(drive, known, fused, sent[0], sent[1], h)
    innovation = seen * (angle - fused[0] - since * fused[1])
    for i in range(3):
        fused[i] = fused[i] + gain[i] * innovation
        now[i] = fused[i]
    for past in range(captured, tick):
        sent = rows_of(observer.delivered[past % size])
        propagate(drive, known, now, sent[0], sent[1], h)
    observer.at[0] = captured


@compiled
def predict(observer: Any, drive: Any, known: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """Remember what is delivered over this tick and go on over it."""
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    sent[0] = plus
    sent[1] = minus
    propagate(drive, known, rows_of(observer.now), plus, minus, h)


@compiled
def go_on(watch: Any, drive: Any, known: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """`predict` behind a camera; nothing where there is none."""
    if watch is not None:
        predict(watch.observer, drive, known, tick, plus, minus, h)
