"""wristctl itself, as its commands call it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from task import Task

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.reference import Motion
from wristctl.simulation.rollout import rollout


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One lane is recorded, as `simulate` does it; many are not, as in `tune`."""
    loop = Loop(plant_segments=task.segments, control_period=task.period, substeps=steps)
    time, nothing = np.arange(task.ticks) * task.period, np.zeros((task.ticks, 2))
    whole = Motion(time, *task.reference.T, task.reference[:, 0], nothing, task.rest, task.ticks * task.period)
    law, wrist = controller("smc"), WristParameters()
    gains, which = np.tile(task.gains, (lanes, 1)), np.zeros(lanes, np.int64)

    def run(ticks: int) -> np.ndarray:
        parts = {name: getattr(whole, name)[:ticks] for name in
                 ("time", "theta_ref", "rate_ref", "acceleration_ref", "theta_desired", "tip_desired")}
        motion = replace(whole, **parts, horizon=ticks * task.period)
        record = lanes == 1
        done = rollout(law, gains, [motion], which, loop, wrist, record=record, threads=threads)
        return done.column("theta", 0) if record else done.metrics["rmse"]

    run(10)
    return run
