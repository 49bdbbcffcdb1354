"""Outcome of rollouts in two planes: metrics, failures, and what was recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.lanes.blocks import to_rows
from wristctl.simulation.bend_course import BEND_METRICS, BendCourse, BendTotals
from wristctl.simulation.bend_sums import BEND_SUMS
from wristctl.simulation.oscillation import oscillations
from wristctl.simulation.spatial_batch import SpatialBatch
from wristctl.simulation.spatial_kernel import SPATIAL_BRIEFLY, SPATIAL_RECORDED
from wristctl.simulation.worlds import World


@dataclass(frozen=True)
class BendOutcome:
    """Outcome of rollouts in two planes."""

    metrics: dict[str, Array]
    """Those that come from sums, (count,) each, by name."""
    failed: NDArray[np.bool_]
    """(count,)"""
    until: Array
    """Time when each was last within its range (count,) [s]."""
    time: Array
    """Of the samples (T,) [s]."""
    bend_ref: Array
    """(T, 2) [rad]"""
    bends: Array | None
    """Bends of the last disc (count, T, 2) [rad], where they are recorded; nan after a wrist has failed."""
    courses: Sequence[BendCourse]
    """What each did, where all of it is recorded."""

    def all_metrics(self) -> dict[str, Array]:
        """All metrics of rollouts whose bends are recorded, (count,) each."""
        metrics = self.metrics | {"oscillation": self._oscillation()}
        return {name: metrics[name] for name in BEND_METRICS}

    def _oscillation(self) -> Array:
        """The greater of both planes' oscillations (count,) [rad]; nan where a wrist has failed."""
        assert self.bends is not None
        oscillation, well, step = np.full(len(self.failed), np.nan), ~self.failed, float(self.time[1] - self.time[0])
        planes = [
            oscillations(np.ascontiguousarray(self.bends[well, :, plane]), self.bend_ref.T, which, step)
            for plane, which in enumerate(np.repeat([[0], [1]], well.sum(), axis=1))
        ]
        oscillation[well] = np.max(planes, axis=0)
        return oscillation


def bend_outcome(lanes: SpatialBatch, time: Array, worlds: Sequence[World]) -> BendOutcome:
    """Outcome of a batch's rollouts that ran to the end; `time` [s] is that of samples."""
    count, wanted = len(worlds), lanes.course.references[:, 0].T
    sums = dict(zip(BEND_SUMS, to_rows(lanes.state.sums, count).T, strict=False))
    alive, totals = sums["alive"] > 0.0, BendTotals(sums, time)
    metrics = dict[str, Array]()
    with np.errstate(divide="ignore", invalid="ignore"):
        for name, metric in BEND_METRICS.items():
            if metric.of_totals is not None:
                value = metric.of_totals(totals)
                metrics[name] = np.where(alive, value, np.nan) if metric.of_error else value
    record, bends, courses = lanes.state.record, None, list[BendCourse]()
    if record.shape[1]:
        flat = record.reshape(len(record), -1, *record.shape[3:])
        recorded = to_rows(flat, count).reshape(count, len(time), -1)
        bends, spooled = recorded[:, :, :2], worlds[0].loop.actuator.level == "tendon"
        if record.shape[2] > len(SPATIAL_BRIEFLY):
            courses = [
                _course(rows, time, wanted, world, lanes.places, spooled)
                for rows, world in zip(recorded, worlds, strict=True)
            ]
    return BendOutcome(metrics, ~alive, sums["until"], time, wanted, bends, courses)


def _course(rows: Array, time: Array, wanted: Array, world: World, places: int, spooled: bool) -> BendCourse:
    first = len(SPATIAL_RECORDED)
    return BendCourse(
        time=time,
        bend=rows[:, 0:2],
        rate=rows[:, 2:4],
        bend_ref=wanted,
        bend_seen=rows[:, 9:11],
        load_seen=rows[:, 11:13],
        torque_wanted=rows[:, 4:6],
        torque=rows[:, 6:8],
        share=rows[:, 8],
        pulls=rows[:, first : first + places],
        acting=rows[:, first + places : first + 2 * places],
        coordinates=rows[:, first + 3 * places :],
        length=world.plant.length,
        length_known=world.wrist.length,
        spools=rows[:, first + 2 * places : first + 3 * places] if spooled else None,
    )
