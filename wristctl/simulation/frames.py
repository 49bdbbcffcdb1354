"""The camera: when frames are taken and used, and what each rollout's frames add to the angle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Sensor
from wristctl.seeds import Entropy
from wristctl.simulation.observer import Schedule

_NEVER = np.iinfo(np.int64).max
"""A tick."""


def schedule(sensor: Sensor, period: float, horizon: float, believed: Sensor | None = None) -> Schedule:
    """Ticks of one camera's frames of `horizon` [s], (F,) each; the observer dates them by the believed delay."""
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


def side_by_side(schedules: Sequence[Schedule]) -> Schedule:
    """Several cameras' frames as columns, (F, cameras) each; the last ticks of one with fewer frames never come."""
    most = max(len(each.captures) for each in schedules)
    parts = (np.full((most, len(schedules)), _NEVER) for _ in Schedule._fields)
    for part, columns in zip(found := Schedule(*parts), zip(*schedules, strict=True), strict=True):
        for camera, ticks in enumerate(columns):
            part[: len(ticks), camera] = ticks
    return found


def longest(tables: Schedule) -> int:
    """Ticks of what was delivered that an observer of any of these cameras, (F, cameras) each, must remember."""
    behind = tables.arrivals - tables.dated
    between = np.where(tables.dated < _NEVER, np.diff(tables.dated, axis=0, prepend=0), 0)
    return int((behind.max(axis=0) + between.max(axis=0)).max()) + 2


def _delay(sensor: Sensor, period: float) -> int:
    """Control ticks between capture and use."""
    return int(np.ceil(sensor.delay_frames / (sensor.frame_rate * period) - 1e-9))


def readings(
    counts: Sequence[int], sensors: Sequence[Sensor], streams: Sequence[Entropy], bursts: Sequence[float] | None = None
) -> Array:
    """Of so many frames of each rollout the noise [rad], and 1 or 0 for seen or dropped, (rollouts, most frames, 2).

    Rollouts of the same stream meet the same draws, whatever stands beside them in the batch; each camera scales them
    by its own noise and share of dropped frames, which are lost so many in a row, on average, as `bursts` says.
    """
    bursts = bursts or [1.0] * len(sensors)
    lengths = list(zip(streams, counts, strict=True))
    drawn = {each: _draws(*each) for each in dict.fromkeys(lengths)}
    found: Array = np.zeros((len(streams), max(counts), 2))
    for own, length, sensor, burst in zip(found, lengths, sensors, bursts, strict=True):
        normal, even = drawn[length]
        own[: len(normal), 0] = np.deg2rad(sensor.noise_deg) * normal
        own[: len(normal), 1] = _seen(even, sensor.dropped, burst)
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
