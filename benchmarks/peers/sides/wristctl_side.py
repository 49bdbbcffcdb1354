"""wristctl itself, as its commands call it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from task import Task

from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.motion import Motion
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One lane is recorded, as `simulate` does it; many are not, as in `tune`."""
    loop = Loop(plant_segments=task.segments, control_period=task.period, substeps=steps)
    law, wrist, record = controller("smc"), WristParameters(), lanes == 1
    gains, which = np.tile(task.gains, (lanes, 1)), np.zeros(lanes, np.int64)

    @cache
    def course(ticks: int) -> Motion:
        return motion(Reference(duration=task.rest), wrist, ticks * task.period, task.period)

    def run(ticks: int) -> np.ndarray:
        done = rollout(law, gains, [course(ticks)], which, loop, wrist, record=record, threads=threads)
        return done.column("theta", 0) if record else done.metrics["rmse"]

    run(10)
    return run
