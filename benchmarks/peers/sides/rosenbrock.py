"""RODAS3 in JAX on any system of first order, its Jacobian by differentiation, and the closed loop around it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from equations import Segment, pulls
from task import Task

jax.config.update("jax_enable_x64", True)


def closed_loop(task: Task, lanes: int, steps: int, rates: Callable[..., Any]) -> Callable[[int], np.ndarray]:
    """`rates(state, theta, plus, minus)` of one rollout, angles before their rates; `theta`: tip angle at the tick."""
    model, n, h = Segment(*map(float, task.model)), task.segments, task.period / steps
    gains, wanted = [float(g) for g in task.gains], jnp.asarray(task.reference[:, 0])

    def step(state: Any, *drive: Any) -> Any:
        factors = jax.scipy.linalg.lu_factor(jnp.eye(2 * n) * (2.0 / h) - jax.jacfwd(rates)(state, *drive))
        f0 = rates(state, *drive)
        k1 = jax.scipy.linalg.lu_solve(factors, f0)
        k2 = jax.scipy.linalg.lu_solve(factors, f0 + 4.0 / h * k1)
        at = state + 2.0 * k1
        k3 = jax.scipy.linalg.lu_solve(factors, rates(at, *drive) + (k1 - k2) / h)
        at = at + k3
        return at + jax.scipy.linalg.lu_solve(factors, rates(at, *drive) + (k1 - k2 - 8.0 / 3.0 * k3) / h)

    def one(state: Any, theta_ref: Any) -> Any:
        theta, rate = state[:n].sum(), state[n:].sum()
        drive = theta, *pulls(jnp, model, gains, task.low, task.high, theta, rate, theta_ref)
        return jax.lax.fori_loop(0, steps, lambda _, x: step(x, *drive), state)

    each = jax.vmap(one, in_axes=(0, None))

    def tick(index: Any, carry: Any) -> Any:
        states, seen = carry
        return each(states, wanted[index]), seen.at[index].set(states[0, :n].sum())

    @jax.jit
    def loop(ticks: Any) -> Any:
        return jax.lax.fori_loop(0, ticks, tick, (jnp.zeros((lanes, 2 * n)), jnp.zeros(task.ticks)))[1]

    loop(2).block_until_ready()
    return lambda ticks: np.asarray(loop(ticks))[:ticks]
