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
from wristctl.lanes.blocks import lanes_of, spread
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import Drive, at_rest, pulls, tendon_stiffness
from wristctl.simulation.frames import frames
from wristctl.wrist.allocation import torque_of
from wristctl.wrist.segments import load_segments, segments

Array = NDArray[np.float64]

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


class Watch(NamedTuple):
    """One block's camera: its Frames, pictures taken (F,), and the next frame to take and to arrive, `turn`."""

    captures: Any
    arrivals: Any
    readings: Any
    pictures: Any
    turn: Any


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
def watch(camera: Any, observer: Any, drive: Any, known: Any, tick: int, angle: Any, h: float) -> None:
    """Take a frame of the true angle where one is due, and fuse the frame that arrives at this tick, if any."""
    turn = camera.turn
    taken, arrived = turn[0], turn[1]
    if taken < len(camera.captures) and camera.captures[taken] == tick:
        rows_of(camera.pictures)[taken] = angle + rows_of(camera.readings[taken])[0]
        turn[0] = taken + 1
    if arrived < turn[0] and camera.arrivals[arrived] == tick:
        seen = rows_of(camera.readings[arrived])[1]
        fuse(observer, drive, known, camera.captures[arrived], 0.0, tick, rows_of(camera.pictures)[arrived], seen, h)
        turn[1] = arrived + 1


@compiled
def fuse(
    observer: Any, drive: Any, known: Any, captured: int, since: float, tick: int, angle: Any, seen: Any, h: float
) -> None:
    """Fuse an angle taken `since` seconds after tick `captured` (where `seen` is 1, not 0), and predict up to `tick`.

    What was delivered at every tick from the last fused one on must still be in the ring.
    """
    size = observer.delivered.shape[0]
    fused, now = rows_of(observer.fused), rows_of(observer.now)
    for past in range(observer.at[0], captured):
        sent = rows_of(observer.delivered[past % size])
        predict(drive, known, fused, sent[0], sent[1], h)
    innovation = seen * (angle - fused[0] - since * fused[1])
    for i in range(3):
        fused[i] = fused[i] + observer.gain[i] * innovation
        now[i] = fused[i]
    for past in range(captured, tick):
        sent = rows_of(observer.delivered[past % size])
        predict(drive, known, now, sent[0], sent[1], h)
    observer.at[0] = captured


@compiled
def expect(observer: Any, drive: Any, known: Any, tick: int, plus: Any, minus: Any, h: float) -> None:
    """Remember what is delivered over this tick and predict over it."""
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    sent[0] = plus
    sent[1] = minus
    predict(drive, known, rows_of(observer.now), plus, minus, h)


@compiled
def _predict_row(drive: Any, model: Any, state: Any, plus: float, minus: float, h: float) -> None:
    known, x = load_segments(rows_of(model)), rows_of(state)
    predict(drive, known, x, plus + 0.0 * x[0], minus + 0.0 * x[0], h)


def stationary_gain(sensor: Sensor, drive: Drive | None, wrist: WristParameters, period: float) -> Array:
    """The Kalman gain (3,) for one frame after another, from the prediction linearised where the wrist is straight."""
    delivered = at_rest(drive, wrist, np.zeros(1))[[0, 2]]
    small = 1e-6
    states = small * np.eye(4, 3)
    for state in states:
        _predict_row(drive, segments(wrist, 1), state, float(delivered[0]), float(delivered[1]), period)
    tick = (states[:3] - states[3]).T / small
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


def observer_of(
    sensor: Sensor, drive: Drive | None, wrist: WristParameters, period: float, ticks: int, theta: float
) -> Observer:
    """A rollout's observer that knows the angle [rad] of its rest, and remembers the last `ticks` periods."""
    start = np.array([theta, 0.0, 0.0])
    gain = stationary_gain(sensor, drive, wrist, period)
    return Observer(gain, np.zeros((ticks, 2)), start, start.copy(), np.zeros(1, np.int64))


def cameras_of(
    sensor: Sensor,
    drive: Drive | None,
    wrist: WristParameters,
    period: float,
    horizon: float,
    seeds: NDArray[np.int64],
    theta: float,
) -> tuple[Watch, Observer] | None:
    """Cameras and observers of rollouts with these seeds (count,); None where sensors are ideal.

    All but captures, arrivals and gain have the block as their first axis: `of_block` is one block's.
    """
    if sensor.level == "ideal":
        return None
    taken = frames(sensor, period, horizon, seeds)
    longest = int((taken.arrivals - taken.captures).max() + np.diff(taken.captures).max(initial=1)) + 2
    fresh = observer_of(sensor, drive, wrist, period, longest, theta)
    lanes = lanes_of(len(seeds))
    blocks, *wide = lanes.shape
    watch = Watch(
        captures=taken.captures,
        arrivals=taken.arrivals,
        readings=np.ascontiguousarray(np.moveaxis(taken.readings[..., lanes], 2, 0)),
        pictures=np.zeros((blocks, len(taken.captures), *wide)),
        turn=np.zeros((blocks, 2), np.int64),
    )

    def for_each(values: Array) -> Array:
        return spread(values.ravel(), len(seeds)).reshape(blocks, *values.shape, *wide)

    own = {name: for_each(getattr(fresh, name)) for name in ("delivered", "fused", "now")}
    return watch, fresh._replace(**own, at=np.tile(fresh.at, (blocks, 1)))


@compiled
def of_block(watched: Any, block: int) -> Any:
    """One block's camera and observer; None where there are none."""
    if watched is None:
        return None
    camera, observer = watched
    own_camera = Watch(
        camera.captures, camera.arrivals, camera.readings[block], camera.pictures[block], camera.turn[block]
    )
    own_observer = Observer(
        observer.gain, observer.delivered[block], observer.fused[block], observer.now[block], observer.at[block]
    )
    return own_camera, own_observer
