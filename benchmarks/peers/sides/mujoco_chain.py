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


def runner(
    model: Any, steps: int, lanes: int, threads: int, control: Callable[[Any, Any, Any, int], tuple[Any, ...]]
) -> Callable[[int], np.ndarray]:
    """Runs so many lanes from rest; returns the first one's joint angles at each tick, (ticks, joints).

    `control` gives the model's inputs, of NumPy or its names for numbers, the joints' angles and rates, and the tick.
    """
    joints = model.nq

    def single(ticks: int) -> np.ndarray:
        data, seen = mujoco.MjData(model), np.empty((ticks, joints))
        for tick in range(ticks):
            seen[tick] = data.qpos
            data.ctrl[:] = control(scalars, data.qpos.tolist(), data.qvel.tolist(), tick)
            mujoco.mj_step(model, data, steps)
        return seen

    def batch(ticks: int) -> np.ndarray:
        datas = [mujoco.MjData(model) for _ in range(threads)]
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start, seen = np.zeros((lanes, size)), np.empty((ticks, joints))
        states = np.zeros((lanes, steps, size))
        command, nothing = np.zeros((lanes, steps, model.nu)), np.zeros((lanes, steps, 0))
        with rollout.Rollout(nthread=threads if threads > 1 else 0) as pool:
            for tick in range(ticks):
                seen[tick] = start[0, 1 : 1 + joints]
                angles, rates = start[:, 1 : 1 + joints].T, start[:, 1 + joints : 1 + 2 * joints].T
                command[:] = np.stack(control(np, angles, rates, tick), axis=1)[:, None]
                pool.rollout(
                    [model] * lanes, datas, start, command,
                    skip_checks=True, nstep=steps, state=states, sensordata=nothing,
                )  # fmt: skip
                start[:] = states[:, -1]
        return seen

    return single if lanes == 1 else batch


def prepare(
    task: Task, lanes: int, threads: int, steps: int, tendons: bool = False, integrator: str = "implicitfast"
) -> Callable[[int], np.ndarray]:
    """One lane by mj_step, more by `rollout` on as many threads as allowed, the law in NumPy between ticks.

    Its integrator implicit in damping is the default: explicit ones would need 500 steps and more for n = 4.
    """
    model = mujoco.MjModel.from_xml_string(chain.mjcf(task, steps, tendons, integrator))
    known, n = Segment(*map(float, task.model)), task.segments
    gains, wanted = [float(g) for g in task.gains], [float(r) for r in task.reference[:, 0]]

    def control(xp: Any, angles: Any, rates: Any, tick: int) -> tuple[Any, ...]:
        theta = sum(angles)
        plus, minus = pulls(xp, known, gains, task.low, task.high, theta, sum(rates), wanted[tick])
        return (plus, minus) if tendons else (torque(known, theta, plus, minus),) * n

    run = runner(model, steps, lanes, threads, control)
    return lambda ticks: run(ticks).sum(axis=1)
