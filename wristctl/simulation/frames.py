"""The camera: when frames are taken and used, and what each rollout's frames add to the angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.plant import Sensor

Array = NDArray[np.float64]
Ticks = NDArray[np.int64]


class Frames(NamedTuple):
    """F frames: control ticks of capture and arrival (F,), noise [rad] and 1 or 0 for seen or dropped (F, 2, count)."""

    captures: Ticks
    arrivals: Ticks
    readings: Array


def frames(sensor: Sensor, period: float, horizon: float, seeds: NDArray[np.int64]) -> Frames:
    """The frames of rollouts of `horizon` [s] with this control period [s].

    Every seed of `seeds` (count,) has its own stream beside the sensor's, whatever stands beside it in the batch.
    """
    times = np.arange(int(horizon * sensor.frame_rate) + 1) / sensor.frame_rate
    captures = np.rint(times / period).astype(np.int64)
    delay = int(np.ceil(sensor.delay_frames / (sensor.frame_rate * period) - 1e-9))
    streams = {seed: np.random.default_rng([sensor.seed, seed]) for seed in map(int, np.unique(seeds))}
    drawn = {seed: _reading(rng, len(times), sensor) for seed, rng in streams.items()}
    return Frames(captures, captures + delay, np.stack([drawn[int(seed)] for seed in seeds], axis=-1))


def _reading(rng: np.random.Generator, count: int, sensor: Sensor) -> Array:
    noise = np.deg2rad(sensor.noise_deg) * rng.standard_normal(count)
    return np.stack([noise, (rng.random(count) >= sensor.dropped).astype(float)], axis=1)
