"""The camera: when frames are taken and used, and what each rollout's frames add to the angle."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array, distinct
from wristctl.config.plant import Sensor
from wristctl.seeds import Entropy
from wristctl.simulation.observer import Schedule

# A tick, behind which there is room for a delay.
_NEVER = 2**62


def schedule(sensor: Sensor, period: float, horizon: float, believed: Sensor | None = None) -> Schedule:
    """Ticks of one camera's frames of `horizon` [s], (F,); the observer dates them by the believed delay."""
    schedules, _ = side_by_side([sensor], [believed or sensor], period, horizon)
    return Schedule(*(column[..., 0] for column in schedules))


def side_by_side(
    sensors: Sequence[Sensor], believed: Sequence[Sensor], period: float, horizon: float
) -> tuple[Schedule, NDArray[np.int64]]:
    """Ticks of several cameras' frames: those that differ as columns, (F, columns), and each sensor's column.

    The last ticks of one with fewer frames than another never come.
    """
    rates = [sensor.frame_rate for sensor in sensors]
    parts = zip(rates, _delays(sensors, period), _delays(believed, period), strict=True)
    columns, which = distinct(list(parts))
    rate, late, dated = map(np.array, zip(*columns, strict=True))
    counts = _counts(rate, horizon)
    frame = np.arange(counts.max())[:, None]
    ticks = frame / rate
    ticks /= period
    np.rint(ticks, out=ticks)
    ticks[frame >= counts] = _NEVER
    for column in (schedules := Schedule(ticks.astype(np.int64), late, dated)):
        column.setflags(write=False)
    return schedules, which


def frame_counts(sensors: Sequence[Sensor], horizon: float) -> NDArray[np.int64]:
    """Number of frames that each camera takes over the horizon [s]."""
    return _counts(np.array([sensor.frame_rate for sensor in sensors]), horizon)


def _counts(rates: Array, horizon: float) -> NDArray[np.int64]:
    return np.asarray(horizon * rates, np.int64) + 1


def _delays(sensors: Sequence[Sensor], period: float) -> list[int]:
    """Control ticks between capture and use."""
    return [math.ceil(sensor.delay_frames / (sensor.frame_rate * period) - 1e-9) for sensor in sensors]


def remembered(sensors: Sequence[Sensor], believed: Sequence[Sensor], period: float) -> int:
    """Ticks of what was delivered that an observer of any of these cameras must remember: from the frame before the
    one that arrives, which is dated as late as is believed."""
    between = [math.ceil(1.0 / (sensor.frame_rate * period)) for sensor in sensors]
    late = zip(_delays(sensors, period), _delays(believed, period), between, strict=True)
    return max(dated + max(delay - dated, ticks) for delay, dated, ticks in late) + 2


def readings(
    counts: Sequence[int], sensors: Sequence[Sensor], streams: Sequence[Entropy], bursts: Sequence[float] | None = None
) -> Array:
    """Noise [rad] of each rollout's frames, and 1 or 0 for seen or dropped, (rollouts, most frames, 2).

    Rollouts of the same stream meet the same draws, whatever stands beside them in the batch; each camera scales them
    by its own noise and share of dropped frames, which are lost so many in a row, on average, as `bursts` says.
    """
    bursts = bursts or [1.0] * len(sensors)
    lengths = list(zip(streams, counts, strict=True))
    drawn = _draws(dict.fromkeys(lengths))
    noise: Array = np.zeros((len(streams), max(counts), 2))
    for row, length, sensor, burst in zip(noise, lengths, sensors, bursts, strict=True):
        normal, even = drawn[length]
        row[: len(normal), 0] = np.deg2rad(sensor.noise_deg) * normal
        row[: len(normal), 1] = _seen(even, sensor.dropped, burst)
    return noise


def _seen(even: Array, dropped: float, burst: float) -> Array:
    """1 or 0 for seen or lost (F,): each by itself, or Gilbert's two states with bursts of this mean length."""
    if burst <= 1.0 / (1.0 - dropped):  # as short as they are by chance
        return np.asarray(even >= dropped, float)
    begin, stay, visible = dropped / (burst * (1.0 - dropped)), 1.0 - 1.0 / burst, np.empty(len(even))
    lost = False
    for frame, value in enumerate(even):
        lost = value < (stay if lost else begin)
        visible[frame] = not lost
    return visible


def _draws(lengths: Iterable[tuple[Entropy, int]]) -> dict[tuple[Entropy, int], tuple[Array, Array]]:
    """So many normal and so many even draws of each stream, each from its beginning."""
    streams, draws = dict[Entropy, tuple[np.random.Generator, Any]](), {}
    for stream, count in lengths:
        if stream not in streams:
            rng = np.random.default_rng(stream)
            streams[stream] = rng, rng.bit_generator.state
        rng, rng.bit_generator.state = streams[stream]
        draws[stream, count] = rng.standard_normal(count), rng.random(count)
    return draws
