"""MuJoCo in two planes: a rigid chain with two motors at each universal joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import chain
import mujoco
import numpy as np
from equations import Segment, sliding_mode
from mujoco_chain import runner
from task import BendTask


def prepare(
    task: BendTask, lanes: int, threads: int, steps: int, integrator: str = "implicitfast"
) -> Callable[[int], np.ndarray]:
    """Torques act on the joints as the law wants them: no tendons share them. Bends are sums of the joints' angles."""
    model = mujoco.MjModel.from_xml_string(chain.universal(task, steps, integrator))
    planes = [Segment(*map(float, values)) for values in (task.model_y, task.model_z)]
    gains, n = [float(g) for g in task.gains], task.segments
    targets = task.reference[:, 0].T.tolist()

    def control(xp: Any, angles: Any, rates: Any, tick: int) -> tuple[Any, ...]:
        wanted = (
            sliding_mode(xp, known, gains, sum(angles[plane::2]), sum(rates[plane::2]), targets[tick][plane])
            for plane, known in enumerate(planes)
        )
        return tuple(wanted) * n

    run = runner(model, steps, lanes, threads, control)
    return lambda ticks: run(ticks).ravel()
