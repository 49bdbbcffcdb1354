"""The stationary Kalman filter behind a camera: its gain, and the error that it expects of itself."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.simulation.actuator import at_rest, drive_of
from wristctl.simulation.observer import Observer, propagate
from wristctl.wrist.pcc import PCC
from wristctl.wrist.segments import load_segments, segments


@kernel
def _propagate_row(drive: Any, model: Any, state: Any, plus: float, minus: float, h: float) -> None:
    known, x = load_segments(rows_of(model)), rows_of(state)
    zero = 0.0 * x[0]
    propagate(drive, known, x, plus + zero, minus + zero, h)


_DOUBLINGS, _ALIKE = 20, 1e-14
"""Doublings at most, and a change of a correlation that is none."""


class _Stationary(NamedTuple):
    """What frames one after another lead to: gain (3,), covariance behind a frame; transition and noise of a tick."""

    gain: Array
    covariance: Array
    tick: Array
    noise: Array


@lru_cache(maxsize=256)
def _stationary(sensor: Sensor, actuator: Actuator, wrist: WristParameters, period: float) -> _Stationary:
    """From the prediction linearised where the wrist is straight."""
    drive = drive_of(actuator)
    delivered = at_rest(drive, wrist, PCC, np.zeros(1))[[0, 2]]
    small = 1e-6
    states = small * np.eye(4, 3)
    for state in states:
        _propagate_row(drive, segments(wrist, 1), state, float(delivered[0]), float(delivered[1]), period)
    tick = (states[:3] - states[3]).T / small
    unknown = tick[1, 2]  # rate gained in one period per unit of torque
    noise = np.diag([0.0, unknown**2 * sensor.torque_noise**2 / period, sensor.load_drift**2 * period])
    frame, between = np.eye(3), np.zeros((3, 3))
    for _ in range(_ticks_of_a_frame(sensor, period)):
        frame, between = tick @ frame, tick @ between @ tick.T + noise
    variance = max(np.deg2rad(sensor.noise_deg) ** 2, 1e-12)
    covariance = _predicted(frame, between, variance)
    gain = covariance[:, 0] / (covariance[0, 0] + variance)
    gain.setflags(write=False)
    return _Stationary(gain, covariance - gain[:, None] * covariance[0], tick, noise)


def _predicted(frame: Array, between: Array, variance: float) -> Array:
    """The covariance (3, 3) before a frame that frames one after another lead to, each the first entry's reading.

    Of P = F (P - P c c^T P/(c^T P c + R)) F^T + Q by doubling (Anderson, Int. J. Control 28 (1978) 295): step k has
    seen 2^k frames.
    """
    onward, seen, covariance = frame.T, np.zeros((3, 3)), between
    seen[0, 0] = 1.0 / variance
    for _ in range(_DOUBLINGS):
        shrunk = np.linalg.solve(np.eye(3) + seen @ covariance, np.hstack([onward, seen]))
        grown = covariance + onward.T @ covariance @ shrunk[:, :3]
        seen = seen + onward @ shrunk[:, 3:] @ onward.T
        onward = onward @ shrunk[:, :3]
        deviation = np.sqrt(np.diag(grown))
        if (np.abs(grown - covariance) <= _ALIKE * deviation * deviation[:, None]).all():
            return grown
        covariance = grown
    return covariance


def _ticks_of_a_frame(sensor: Sensor, period: float) -> int:
    return max(1, round(1.0 / (sensor.frame_rate * period)))


def stationary_gain(sensor: Sensor, actuator: Actuator, wrist: WristParameters, period: float) -> Array:
    """The Kalman gain (3,) for one frame after another."""
    return _stationary(sensor, actuator, wrist, period).gain


def expected_error(sensor: Sensor, actuator: Actuator, wrist: WristParameters, period: float) -> float:
    """Standard deviation [rad] of what a law sees less the true angle, by the observer's own covariance.

    That is behind a frame and the prediction from it, on average over the ticks for which it is the last to have
    arrived. Frames that are lost, and all that differs from what is believed, come on top.
    """
    _, covariance, tick, noise = _stationary(sensor, actuator, wrist, period)
    late, ticks = round(sensor.delay_frames / (sensor.frame_rate * period)), _ticks_of_a_frame(sensor, period)
    variances = []
    for age in range(late + ticks):
        if age >= late:
            variances.append(covariance[0, 0])
        covariance = tick @ covariance @ tick.T + noise
    return float(np.sqrt(np.mean(variances)))


def observer_of(
    sensor: Sensor, actuator: Actuator, wrist: WristParameters, period: float, ticks: int, theta: float
) -> Observer:
    """A rollout's observer that knows the angle [rad] of its rest, and remembers the last `ticks` periods."""
    start = np.array([theta, 0.0, 0.0])
    gain = stationary_gain(sensor, actuator, wrist, period).copy()
    return Observer(gain, np.zeros((ticks, 2)), start, start.copy(), np.zeros(1, np.int64))
