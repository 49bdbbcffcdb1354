"""The camera: when frames are taken and used, and what each rollout's frames add to the angle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Sensor
from wristctl.seeds import Entropy
from wristctl.simulation.observer import Schedule


def schedule(sensor: Sensor, period: float, horizon: float, believed: Sensor | None = None) -> Schedule:
    """Control ticks of the frames of `horizon` [s], (F,) each; the observer dates them by the believed delay."""
    return _schedule(sensor.frame_rate, _delay(sensor, period), _delay(believed or sensor, period), period, horizon)


@lru_cache(maxsize=64)
def _schedule(frame_rate: float, late: int, believed: int, period: float, horizon: float) -> Schedule:
    times = np.arange(int(horizon * frame_rate) + 1) / frame_rate
    captures = np.rint(times / period).astype(np.int64)
    arrivals = captures + late
    found = Schedule(captures, arrivals, np.maximum(arrivals - believed, 0))
    for each in found:
        each.setflags(write=False)
    return found


def _delay(sensor: Sensor, period: float) -> int:
    """Control ticks between capture and use."""
    return int(np.ceil(sensor.delay_frames / (sensor.frame_rate * period) - 1e-9))


def readings(
    count: int, sensors: Sequence[Sensor], streams: Sequence[Entropy], bursts: Sequence[float] | None = None
) -> Array:
    """Of `count` frames of each rollout the noise [rad], and 1 or 0 for seen or dropped, (rollouts, count, 2).

    Rollouts of the same stream meet the same draws, whatever stands beside them in the batch; each camera scales them
    by its own noise and share of dropped frames, which are lost so many in a row, on average, as `bursts` says.
    """
    bursts = bursts or [1.0] * len(sensors)
    drawn = {each: _draws(each, count) for each in dict.fromkeys(streams)}
    found = np.empty((len(streams), count, 2))
    for own, sensor, stream, burst in zip(found, sensors, streams, bursts, strict=True):
        normal, even = drawn[stream]
        own[:, 0] = np.deg2rad(sensor.noise_deg) * normal
        own[:, 1] = _seen(even, sensor.dropped, burst)
    return found


def _seen(even: Array, dropped: float, burst: float) -> Array:
    """1 or 0 for seen or lost (F,): each by itself, or Gilbert's two states with bursts of this mean length."""
    if burst <= 1.0 / (1.0 - dropped):  # as short as they are by chance
        return np.asarray(even >= dropped, float)
    begin, stay, seen = dropped / (burst * (1.0 - dropped)), 1.0 - 1.0 / burst, np.empty(len(even))
    lost = False
    for at, value in enumerate(even):
        lost = value < (stay if lost else begin)
        seen[at] = not lost
    return seen


def _draws(stream: Entropy, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(stream)
    return rng.standard_normal(count), rng.random(count)
