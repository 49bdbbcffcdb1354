"""The observer that all controllers share where a camera measures: a Kalman filter on the one-segment model.

Its state is x = (theta, rate, d), d a load torque that walks at random: it takes up wrong stiffness and payload, which
would otherwise stay as an error. A frame is fused at its capture time; from there the filter predicts forward with
what the motors have delivered since. The gain is the stationary one for the frame rate.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.plant import Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.model import one_segment
from wristctl.lanes.blocks import to_blocks
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import part, rows_of
from wristctl.lanes.types import LANES
from wristctl.simulation.actuator import Drive, at_rest, pulls, tendon_stiffness
from wristctl.simulation.camera import frames
from wristctl.wrist.allocation import torque_of
from wristctl.wrist.segments import load_segments, segments

Array = NDArray[np.float64]

_ONE = (0,)


class Observer(NamedTuple):
    """One block's observer: frames, gain (3,), what was delivered (ring, 2, LANES), pictures (F, LANES), estimates.

    `fused` holds x at the last fused frame, `now` x at the present tick, (3, LANES); `clock` the next frame to take,
    the next to arrive, and the tick of `fused`.
    """

    captures: Any
    arrivals: Any
    readings: Any
    gain: Any
    delivered: Any
    pictures: Any
    fused: Any
    now: Any
    clock: Any


@compiled
def predict(drive: Any, known: Any, x: Any, plus: Any, minus: Any, h: float) -> None:
    """Advance x by one control period, linearly implicit in damping and stiffness."""
    theta, rate = part(x, 0, _ONE), part(x, 1, _ONE)
    angle, speed, load = x[0], x[1], x[2]
    pull_plus, pull_minus = pulls(drive, known, theta, rate, 0.0, plus, minus)
    inertia, resisting = one_segment(known, angle, speed)
    stiffness = known.stiffness + 0.0 * angle
    stiffness = stiffness + tendon_stiffness(drive, known, angle)
    push = torque_of(angle, known, pull_plus, pull_minus) + load - resisting - h * stiffness * speed
    speed = speed + h * push / (inertia + h * known.damping + h * h * stiffness)
    x[0] = angle + h * speed
    x[1] = speed


@compiled
def observe(observer: Any, drive: Any, known: Any, tick: int, angle: Any, h: float) -> None:
    """Take a frame of the true angle where one is due, and fuse the frame that arrives at this tick, if any."""
    clock = observer.clock
    taken, arrived = clock[0], clock[1]
    if taken < len(observer.captures) and observer.captures[taken] == tick:
        rows_of(observer.pictures)[taken] = angle + rows_of(observer.readings[taken])[0]
        clock[0] = taken + 1
    if arrived < clock[0] and observer.arrivals[arrived] == tick:
        size = observer.delivered.shape[0]
        fused, now = rows_of(observer.fused), rows_of(observer.now)
        captured = observer.captures[arrived]
        for past in range(clock[2], captured):
            sent = rows_of(observer.delivered[past % size])
            predict(drive, known, fused, sent[0], sent[1], h)
        seen = rows_of(observer.readings[arrived])[1]
        innovation = seen * (rows_of(observer.pictures)[arrived] - fused[0])
        for i in range(3):
            fused[i] = fused[i] + observer.gain[i] * innovation
            now[i] = fused[i]
        for past in range(captured, tick):
            sent = rows_of(observer.delivered[past % size])
            predict(drive, known, now, sent[0], sent[1], h)
        clock[1] = arrived + 1
        clock[2] = captured


@compiled
def expect(observer: Any, drive: Any, known: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """Remember what is delivered over this tick and predict over it."""
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    sent[0] = plus
    sent[1] = minus
    predict(drive, known, rows_of(observer.now), plus, minus, h)


@compiled
def _predict_rows(drive: Any, model: Any, states: Any, plus: float, minus: float, h: float) -> None:
    known, x = load_segments(rows_of(model)), rows_of(states)
    predict(drive, known, x, plus + 0.0 * x[0], minus + 0.0 * x[0], h)


def stationary_gain(sensor: Sensor, drive: Drive | None, wrist: WristParameters, period: float) -> Array:
    """The Kalman gain (3,) for one frame after another, from the prediction linearised where the wrist is straight."""
    delivered = at_rest(drive, wrist, np.zeros(1))[[0, 2]]
    small = 1e-6
    states = np.zeros((3, LANES))
    states[:, :3] = small * np.eye(3)
    model = to_blocks(segments(wrist, 1)[None])[0]
    _predict_rows(drive, model, states, float(delivered[0]), float(delivered[1]), period)
    tick = (states[:, :3] - states[:, 3:4]) / small
    unknown = tick[1, 2]  # rate gained in one period per unit of torque
    noise = np.diag([0.0, unknown**2 * sensor.torque_noise**2 / period, sensor.load_drift**2 * period])
    ticks = max(1, round(1.0 / (sensor.frame_rate * period)))
    frame, between = np.eye(3), np.zeros((3, 3))
    for _ in range(ticks):
        frame, between = tick @ frame, tick @ between @ tick.T + noise
    variance = max(np.deg2rad(sensor.noise_deg) ** 2, 1e-12)
    covariance, gain = between, np.zeros(3)
    for _ in range(500):
        gain = covariance[:, 0] / (covariance[0, 0] + variance)
        covariance = frame @ (covariance - np.outer(gain, covariance[0])) @ frame.T + between
    return gain


def observers_of(
    sensor: Sensor,
    drive: Drive | None,
    wrist: WristParameters,
    period: float,
    horizon: float,
    seeds: NDArray[np.int64],
    theta: Array,
) -> list[Observer] | list[None]:
    """One observer for each block of the rollouts with these seeds (count,); None for each where the sensor is ideal.

    They know the angles (n,) at which the wrist starts.
    """
    count, blocks = len(seeds), -(-len(seeds) // LANES)
    if sensor.level == "ideal":
        return [None] * blocks
    taken = frames(sensor, period, horizon, seeds)
    gain = stationary_gain(sensor, drive, wrist, period)
    longest = int((taken.arrivals - taken.captures).max() + np.diff(taken.captures).max(initial=1)) + 2
    start = np.zeros((3, LANES))
    start[0] = theta.sum()
    lanes = np.minimum(np.arange(blocks * LANES), count - 1).reshape(blocks, LANES)
    return [
        Observer(
            captures=taken.captures,
            arrivals=taken.arrivals,
            readings=np.ascontiguousarray(taken.readings[..., members]),
            gain=gain,
            delivered=np.zeros((longest, 2, LANES)),
            pictures=np.zeros((len(taken.captures), LANES)),
            fused=start.copy(),
            now=start.copy(),
            clock=np.zeros(3, np.int64),
        )
        for members in lanes
    ]
