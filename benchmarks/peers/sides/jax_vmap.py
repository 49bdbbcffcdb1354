"""The same equations in JAX as its users write them: one rollout, its Jacobian by differentiation, then vmap."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from dynamics import bias, mass_matrix, posture
from equations import Segment
from rosenbrock import closed_loop
from task import Task


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """Linear systems by jnp.linalg."""
    plant, n = Segment(*map(float, task.plant)), task.segments

    def rates(state: Any, theta: Any, plus: Any, minus: Any) -> Any:
        angles, omega = list(state[:n]), list(state[n:])
        p = posture(plant, angles, plus, minus)
        mass = jnp.stack([jnp.stack(row) for row in mass_matrix(plant, p)])
        return jnp.concatenate([state[n:], -jnp.linalg.solve(mass, jnp.stack(bias(plant, angles, omega, p)))])

    return closed_loop(task, lanes, steps, rates)
