"""MuJoCo: a rigid chain with motors; all lanes of a tick through its native `rollout`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import chain
import mujoco
import numpy as np
import scalars
from equations import Segment, pulls, torque
from mujoco import rollout
from task import Task


def prepare(
    task: Task, lanes: int, threads: int, steps: int, tendons: bool = False, integrator: str = "implicitfast"
) -> Callable[[int], np.ndarray]:
    """One lane by mj_step, more by `rollout` on as many threads as allowed, the law in NumPy between ticks.

    Its integrator implicit in damping is the default: explicit ones would need 500 steps and more for n = 4.
    """
    model = mujoco.MjModel.from_xml_string(chain.mjcf(task, steps, tendons, integrator))
    known, n = Segment(*map(float, task.model)), task.segments
    gains, wanted = [float(g) for g in task.gains], [float(r) for r in task.reference[:, 0]]

    def control(xp: Any, theta: Any, rate: Any, theta_ref: float) -> tuple[Any, ...]:
        plus, minus = pulls(xp, known, gains, task.low, task.high, theta, rate, theta_ref)
        return (plus, minus) if tendons else (torque(known, theta, plus, minus),) * n

    def single(ticks: int) -> np.ndarray:
        data, seen = mujoco.MjData(model), np.empty(ticks)
        for tick in range(ticks):
            seen[tick] = theta = float(data.qpos.sum())
            data.ctrl[:] = control(scalars, theta, float(data.qvel.sum()), wanted[tick])
            mujoco.mj_step(model, data, steps)
        return seen

    def batch(ticks: int) -> np.ndarray:
        datas = [mujoco.MjData(model) for _ in range(threads)]
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start, seen = np.zeros((lanes, size)), np.empty(ticks)
        states = np.zeros((lanes, steps, size))
        command, nothing = np.zeros((lanes, steps, model.nu)), np.zeros((lanes, steps, 0))
        with rollout.Rollout(nthread=threads if threads > 1 else 0) as pool:
            for tick in range(ticks):
                theta, rate = start[:, 1 : 1 + n].sum(axis=1), start[:, 1 + n : 1 + 2 * n].sum(axis=1)
                seen[tick] = theta[0]
                command[:] = np.stack(control(np, theta, rate, wanted[tick]), axis=1)[:, None]
                pool.rollout(
                    [model] * lanes, datas, start, command,
                    skip_checks=True, nstep=steps, state=states, sensordata=nothing,
                )  # fmt: skip
                start[:] = states[:, -1]
        return seen

    return single if lanes == 1 else batch
