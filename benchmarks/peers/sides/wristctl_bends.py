"""wristctl itself in two planes, as its commands call it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from bend_truth import WRIST, loop_of
from task import BendTask

from wristctl.control.table import controller
from wristctl.simulation.two_planes import rollout_bends
from wristctl.simulation.worlds import World


def prepare(
    task: BendTask, lanes: int, threads: int, steps: int, actuator: str = "ideal"
) -> Callable[[int], np.ndarray]:
    """One lane is recorded, as `simulate` does it; many are not."""
    record = lanes == 1
    law, worlds = controller("smc"), [World(loop_of(task, steps, actuator), WRIST)] * lanes
    gains = np.tile(task.gains, (lanes, 1))

    def run(ticks: int) -> np.ndarray:
        done = rollout_bends(law, gains, task.reference[:, :, :ticks], worlds, threads=threads, record=record)
        return done.courses[0].coordinates.ravel() if record else done.metrics["rmse"]

    run(10)
    return run
