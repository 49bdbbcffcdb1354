"""Rollouts: many closed loops of one controller at once, as blocks of lanes over threads."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller
from wristctl.lanes.blocks import lanes_of, spread, to_rows, width
from wristctl.lanes.cores import cores
from wristctl.simulation.actuator import at_rest, drive_of
from wristctl.simulation.disturbances import course
from wristctl.simulation.kernel import RECORDED, run_blocks
from wristctl.simulation.metrics import SUMS, summary
from wristctl.simulation.observer import cameras_of
from wristctl.simulation.plant import plant_of
from wristctl.simulation.reference import Motion
from wristctl.wrist.segments import segments

Array = NDArray[np.float64]

_SLICE_TICKS = 200_000
"""Control ticks of a block between two looks at whether the user has asked to stop."""
_SHARES = 8
"""Least number of pieces of work for each thread, where there are so many blocks, so that all end together."""


@dataclass(frozen=True)
class Outcome:
    """Metrics of each rollout, shape (count,), and, where recorded, its samples (count, T, columns)."""

    metrics: dict[str, Array]
    failed: NDArray[np.bool_]
    """Rollouts whose wrist bent beyond a full turn, or not to any number at all."""
    samples: Array | None

    def column(self, name: str, rollout: int) -> Array:
        """One recorded column of one rollout, (T,)."""
        assert self.samples is not None
        return self.samples[rollout, :, RECORDED.index(name)]

    def segment_theta(self, rollout: int) -> Array:
        """Angles of the plant's segments, (T, n) [rad]."""
        assert self.samples is not None
        return self.samples[rollout, :, len(RECORDED) :]


def sample_period(loop: Loop) -> float:
    """Time between samples of references and records: 1 ms, or the control period where that is longer [s]."""
    return max(loop.control_period, round(1e-3 / loop.control_period) * loop.control_period)


def rollout(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    which: NDArray[np.int64],
    loop: Loop,
    wrist: WristParameters,
    start: Array | None = None,
    seeds: NDArray[np.int64] | None = None,
    record: bool = False,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Outcome:
    """Run `count` closed loops: gains (count, g) and for each the index (count,) of the motion that it follows.

    They begin at rest with the segments' angles `start` (n,), straight where none is given. The controller's
    one-segment model comes from `wrist`; the loop says how finely the plant is cut, how it differs, and what stands
    between command and measurement. `seeds` (count,) number the camera's noise; all have the same where none is given.
    """
    count, n = len(gains), loop.plant_segments
    ticks = max(1, round(sample_period(loop) / loop.control_period))
    samples = len(motions[0].theta_ref)
    limit = wrist.tension_limit if loop.limits else np.inf
    actual = plant_of(wrist, loop.plant)
    fixed = [segments(actual, n), segments(wrist, 1), np.array([wrist.pretension, limit])]
    plant, model, limits = (spread(row, width(count))[0] for row in fixed)
    goal_rows = np.array([[m.final, m.move, m.begin, m.rest, m.horizon] for m in motions])[which]
    rest = np.zeros(n) if start is None else start
    drive, period = drive_of(loop.actuator), loop.control_period
    begin_with = {
        "gains": gains.reshape(count, -1),
        "goals": goal_rows,
        "sums": np.array([float(name == "alive") for name in SUMS]),
        "memory": np.zeros(max(1, controller.memory)),
        "state": np.concatenate([rest, np.zeros(n)]),
        "motors": at_rest(drive, actual, rest),
    }
    blocks = {name: spread(row, count) for name, row in begin_with.items()}
    lanes = lanes_of(count)
    total, *wide = lanes.shape
    followed = which[lanes].reshape(total, -1)
    courses = np.array([np.stack([m.theta_ref, m.rate_ref, m.acceleration_ref], axis=1) for m in motions])
    disturbed = course(loop.disturbances, motions[0].time)
    streams = np.zeros(count, np.int64) if seeds is None else seeds
    cameras = cameras_of(loop.sensor, drive, wrist, period, motions[0].horizon, streams, rest.sum())
    recorded = np.empty((total, samples if record else 0, len(RECORDED) + n, *wide))
    workers = threads or cores()
    each = samples * ticks * loop.substeps
    together = max(1, min(_SLICE_TICKS // each, total // (_SHARES * workers)))
    law = controller.compiled(count)
    stop, done = threading.Event(), [0] * total

    def run(begin: int) -> None:
        end = min(begin + together, total)
        now, target = np.zeros((len(NOW), *wide)), np.zeros((3, *wide))
        piece = max(1, _SLICE_TICKS // (ticks * loop.substeps))
        for first in range(0, samples, piece):
            if stop.is_set():
                return
            last = min(first + piece, samples)
            run_blocks(
                law, plant, model, limits, blocks["gains"], blocks["goals"], courses, followed,
                blocks["memory"], blocks["state"], blocks["sums"], recorded, drive, blocks["motors"], cameras,
                disturbed, now, target, period, loop.substeps, ticks, begin, end, first, last, (0,) * n,
            )  # fmt: skip
            done[begin:end] = [last] * (end - begin)

    pieces = range(0, total, together)
    with ThreadPoolExecutor(workers) as pool:
        try:
            for _ in pool.map(run, pieces) if min(workers, len(pieces)) > 1 else map(run, pieces):
                if progress is not None:
                    progress(sum(done) / (total * samples))
        except BaseException:
            stop.set()
            raise

    sums = to_rows(blocks["sums"], count)
    kept = to_rows(recorded.reshape(total, -1, *wide), count).reshape(count, samples, -1) if record else None
    metrics = summary(sums, goal_rows, loop.control_period)
    return Outcome(metrics, sums[:, SUMS.index("alive")] <= 0.0, kept)
