"""Where the state of many rollouts stands in a batch, as one row of numbers for each rollout."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.simulation.actuator import IdealDrive, SpoolDrive
from wristctl.simulation.batch import Batch
from wristctl.simulation.observer import Watch
from wristctl.wrist.elastic import OF_A_TENDON, PATH, PulledTendons, RealTendons

_ANGLE, _RATE, _PULL, _LENGTH = 1.0, 10.0, 10.0, 1e-3
"""Typical sizes [rad, rad/s, N, m], by which small changes are measured."""


class StatePart(NamedTuple):
    """Some of the variables: the array that holds them by block, which of its flat rows, and their typical sizes."""

    name: str
    array: Array
    rows: NDArray[np.int64]
    sizes: Array


class Remembered(NamedTuple):
    """How far back a loop remembers: ticks of what its motors delivered, and frames under way."""

    ticks: int
    frames: int


def state_parts(batch: Batch, memory: int, tick: int, back: Remembered) -> Iterator[StatePart]:
    """The parts of the state before a tick, in the same order at every tick; of each, what changes.

    What was delivered and the frames under way come as they are counted back from the tick.
    """
    state, drive, k = batch.state, batch.world.drive, len(batch.setup.coordinates)
    yield StatePart("memory", state.memory, np.arange(memory), np.ones(memory))
    yield StatePart("angle", state.coordinates, np.arange(k), np.full(k, _ANGLE))
    yield StatePart("rate", state.coordinates, np.arange(k, 2 * k), np.full(k, _RATE))
    size = _LENGTH if isinstance(drive, SpoolDrive) else _PULL
    if not isinstance(drive, IdealDrive):
        yield StatePart("motor", state.motors, np.array([0, 2]), np.full(2, size))
    if isinstance(state.tendons, RealTendons):
        rows, own = state.tendons.state, len(OF_A_TENDON)
        count = (rows.shape[1] - PATH - k) // own
        yield StatePart("path", rows, np.arange(PATH), np.array([_LENGTH, _LENGTH, _ANGLE]))
        bristles = PATH + own * np.arange(count)
        yield StatePart("bristle", rows, bristles, np.ones(count))
        yield StatePart("tendon creep", rows, bristles + 1, np.full(count, _LENGTH))
    if isinstance(state.tendons, (PulledTendons, RealTendons)):
        rows = state.tendons.state
        yield StatePart("spring creep", rows, np.arange(rows.shape[1] - k, rows.shape[1]), np.full(k, _ANGLE))
    if isinstance(state.watch, Watch):
        observer, taken = state.watch.observer, int(state.watch.turn[0, 0, 0])
        sizes = np.array([_ANGLE, _RATE, _ANGLE])
        yield StatePart("estimate", observer.now, np.arange(3), sizes)
        yield StatePart("estimate at the frame", observer.fused, np.arange(3), sizes)
        ring = np.arange(tick - back.ticks, tick) % observer.delivered.shape[1]
        sent = np.stack([2 * ring, 2 * ring + 1], axis=1).ravel()
        yield StatePart("delivered", observer.delivered, sent, np.full(len(sent), size))
        frames = np.arange(taken - back.frames, taken)
        yield StatePart("frame", state.watch.pictures, frames, np.full(len(frames), _ANGLE))


def read_state(parts: Iterator[StatePart], count: int) -> Array:
    """The state of each rollout, (count, variables)."""
    found = [to_rows(np.ascontiguousarray(_flat(each)[:, each.rows]), count) for each in parts if len(each.rows)]
    return np.concatenate(found, axis=1)


def write_state(parts: Iterator[StatePart], states: Array) -> None:
    """Put the states (count, variables) where they stand."""
    at = 0
    for each in parts:
        if len(each.rows):
            _flat(each)[:, each.rows] = to_blocks(states[:, at : at + len(each.rows)])
            at += len(each.rows)


def _flat(part: StatePart) -> Array:
    """A view of its array, (blocks, rows, lanes)."""
    return part.array.reshape(len(part.array), -1, part.array.shape[-1])
