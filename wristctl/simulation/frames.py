"""The camera: when frames are taken and used, and what each rollout's frames add to the angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Sensor
from wristctl.seeds import Entropy
from wristctl.simulation.observer import Schedule


def schedule(sensor: Sensor, period: float, horizon: float, believed: Sensor | None = None) -> Schedule:
    """Control ticks of the frames of `horizon` [s], (F,) each; the observer dates them by the believed delay."""
    times = np.arange(int(horizon * sensor.frame_rate) + 1) / sensor.frame_rate
    captures = np.rint(times / period).astype(np.int64)
    arrivals = captures + _delay(sensor, period)
    return Schedule(captures, arrivals, np.maximum(arrivals - _delay(believed or sensor, period), 0))


def _delay(sensor: Sensor, period: float) -> int:
    """Control ticks between capture and use."""
    return int(np.ceil(sensor.delay_frames / (sensor.frame_rate * period) - 1e-9))


def readings(count: int, sensors: Sequence[Sensor], streams: Sequence[Entropy]) -> Array:
    """Of `count` frames of each rollout the noise [rad], and 1 or 0 for seen or dropped, (rollouts, count, 2).

    Rollouts of the same stream meet the same draws, whatever stands beside them in the batch; each camera scales them
    by its own noise and share of dropped frames.
    """
    drawn = {each: _draws(each, count) for each in dict.fromkeys(streams)}
    found = np.empty((len(streams), count, 2))
    for own, sensor, stream in zip(found, sensors, streams, strict=True):
        normal, even = drawn[stream]
        own[:, 0] = np.deg2rad(sensor.noise_deg) * normal
        own[:, 1] = even >= sensor.dropped
    return found


def _draws(stream: Entropy, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(stream)
    return rng.standard_normal(count), rng.random(count)
