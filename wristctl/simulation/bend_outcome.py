"""Outcome of rollouts in two planes: metrics, failures, and what was recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.control.response import OF_A_PLANE
from wristctl.lanes.blocks import to_rows
from wristctl.simulation.batch import Batch
from wristctl.simulation.bend_course import BEND_METRICS, BendCourse
from wristctl.simulation.kernel import columns_of_brief, columns_of_sample
from wristctl.simulation.metrics import summary
from wristctl.simulation.oscillation import oscillations
from wristctl.simulation.rollout import totals_of
from wristctl.simulation.worlds import World
from wristctl.wrist.tendon_layout import TendonLayout


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


def bend_outcome(rollouts: Batch, time: Array, worlds: Sequence[World], layout: TendonLayout) -> BendOutcome:
    """Outcome of a batch's rollouts that ran to the end; `time` [s] is that of samples."""
    count, wanted = len(worlds), rollouts.course.references[0, [0, OF_A_PLANE]].T
    names, totals = columns_of_sample(2, len(layout.places)), totals_of(rollouts, count)
    alive, metrics = totals.sums["alive"] > 0.0, summary(totals, BEND_METRICS)
    record, bends, courses = rollouts.state.record, None, list[BendCourse]()
    if record.shape[1]:
        flat = record.reshape(len(record), -1, *record.shape[3:])
        recorded = to_rows(flat, count).reshape(count, len(time), -1)
        bends = recorded[:, :, :2]
        if record.shape[2] > columns_of_brief(2):
            courses = [_course(rows, names, time, wanted, world) for rows, world in zip(recorded, worlds, strict=True)]
    return BendOutcome(metrics, ~alive, totals.sums["until"], time, wanted, bends, courses)


def _course(rows: Array, names: Sequence[str], time: Array, wanted: Array, world: World) -> BendCourse:
    def of(name: str) -> Array:
        """Columns of a name, of all planes or places."""
        return rows[:, [number for number, column in enumerate(names) if column.rpartition("_")[0] == name]]

    return BendCourse(
        time=time,
        bend=of("bend"),
        rate=of("rate"),
        bend_ref=wanted,
        bend_seen=of("seen"),
        load_seen=of("load"),
        torque_wanted=of("torque_wanted"),
        torque=of("torque"),
        share=rows[:, names.index("share")],
        pulls=of("tension"),
        acting=of("acting"),
        coordinates=rows[:, len(names) :],
        length=world.plant.length,
        length_known=world.wrist.length,
        spools=of("delivered") if world.loop.actuator.level == "tendon" else None,
    )
