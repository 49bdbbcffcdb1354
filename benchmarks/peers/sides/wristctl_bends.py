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
    """The whole motion of every lane is kept, as it always is in two planes."""
    law, worlds = controller("smc"), [World(loop_of(task, steps, actuator), WRIST)] * lanes
    gains = np.tile(task.gains, (lanes, 1))

    def run(ticks: int) -> np.ndarray:
        courses = rollout_bends(law, gains, task.reference[:, :, :ticks], worlds, threads=threads)
        return courses[0].coordinates.ravel()

    run(10)
    return run
