"""wristctl itself in two planes, as its commands call it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from bend_truth import WRIST, loop_of
from task import BendTask

from wristctl.control.table import controller
from wristctl.simulation.motion import Motion
from wristctl.simulation.rollout import rollout


def prepare(
    task: BendTask, lanes: int, threads: int, steps: int, actuator: str = "ideal"
) -> Callable[[int], np.ndarray]:
    """One lane is recorded, as `simulate` does it; many are not."""
    record = lanes == 1
    law, loop, which = controller("smc"), loop_of(task, steps, actuator), np.zeros(lanes, np.int64)
    gains = np.tile(task.gains, (lanes, 1))

    def run(ticks: int) -> np.ndarray:
        followed = Motion.of_bends(task.reference[:, :, :ticks], task.period, WRIST.length)
        done = rollout(
            law, gains, [followed], which, loop, WRIST, record=record, threads=threads, converge=False
        )  # fmt: skip
        return done.coordinates(0).ravel() if record else done.metrics["rmse"]

    run(10)
    return run
