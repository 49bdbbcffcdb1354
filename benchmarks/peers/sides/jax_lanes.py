"""The same equations in JAX, every variable an array of lanes: the layout that suits its compiler best."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from equations import Segment, pulls
from rodas3 import step
from task import Task

jax.config.update("jax_enable_x64", True)


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """Compiled once for each number of lanes; the number of ticks is an argument."""
    plant, model = Segment(*map(float, task.plant)), Segment(*map(float, task.model))
    gains, wanted = [float(g) for g in task.gains], jnp.asarray(task.reference[:, 0])
    n = task.segments

    def tick(index: Any, carry: Any) -> Any:
        theta, omega, seen = carry
        angle, rate = sum(theta), sum(omega)
        seen = seen.at[index].set(angle[0])
        plus, minus = pulls(jnp, model, gains, task.low, task.high, angle, rate, wanted[index])
        for _ in range(steps):
            theta, omega = step(plant, theta, omega, plus, minus, task.period / steps)
        return theta, omega, seen

    @jax.jit
    def loop(ticks: Any) -> Any:
        still = [jnp.zeros(max(lanes, 4))] * n  # one lane alone is slower, and takes its compiler minutes
        return jax.lax.fori_loop(0, ticks, tick, (still, still, jnp.zeros(task.ticks)))[2]

    loop(2).block_until_ready()
    return lambda ticks: np.asarray(loop(ticks))[:ticks]
