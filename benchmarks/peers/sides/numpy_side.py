"""The same equations in NumPy, arrays of lanes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from equations import Segment, pulls
from rodas3 import step
from task import Task


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One thread, whatever `threads` says: NumPy's elementwise functions have no more."""
    plant, model = Segment(*map(float, task.plant)), Segment(*map(float, task.model))

    def run(ticks: int) -> np.ndarray:
        theta, omega = ([np.zeros(lanes) for _ in range(task.segments)] for _ in range(2))
        seen = np.empty(ticks)
        for tick in range(ticks):
            angle, rate = sum(theta[1:], theta[0]), sum(omega[1:], omega[0])
            seen[tick] = angle[0]
            plus, minus = pulls(np, model, task.gains, task.low, task.high, angle, rate, task.reference[tick, 0])
            for _ in range(steps):
                theta, omega = step(plant, theta, omega, plus, minus, task.period / steps)
        return seen

    return run
