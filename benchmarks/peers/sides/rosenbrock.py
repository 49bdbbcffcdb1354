"""RODAS3 in JAX on any system of first order, its Jacobian by differentiation, and the closed loop around it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from equations import Segment, pulls
from task import BendTask, Task

jax.config.update("jax_enable_x64", True)


def closed_loop(task: Task, lanes: int, steps: int, rates: Callable[..., Any]) -> Callable[[int], np.ndarray]:
    """`rates(state, theta, plus, minus)` of one rollout, angles before their rates; `theta`: tip angle at the tick."""
    model, n = Segment(*map(float, task.model)), task.segments
    gains, wanted = [float(g) for g in task.gains], jnp.asarray(task.reference[:, 0])

    def drive(state: Any, index: Any) -> Any:
        theta, rate = state[:n].sum(), state[n:].sum()
        return theta, *pulls(jnp, model, gains, task.low, task.high, theta, rate, wanted[index])

    return sampled_loop(task, lanes, steps, rates, drive, lambda state: state[:n].sum())


def sampled_loop(
    task: Task | BendTask, lanes: int, steps: int, rates: Callable[..., Any], drive: Callable[[Any, Any], Any],
    seen: Callable[[Any], Any],
) -> Callable[[int], np.ndarray]:  # fmt: skip
    """Lanes from rest under `rates(state, *drive(state, tick))`, what drives them held over a tick.

    Returns what is `seen` of the first lane's state at each tick, (ticks, ...).
    """
    planes = 2 if isinstance(task, BendTask) else 1
    count, h = 2 * planes * task.segments, task.period / steps

    def step(state: Any, *held: Any) -> Any:
        factors = jax.scipy.linalg.lu_factor(jnp.eye(count) * (2.0 / h) - jax.jacfwd(rates)(state, *held))
        f0 = rates(state, *held)
        k1 = jax.scipy.linalg.lu_solve(factors, f0)
        k2 = jax.scipy.linalg.lu_solve(factors, f0 + 4.0 / h * k1)
        at = state + 2.0 * k1
        k3 = jax.scipy.linalg.lu_solve(factors, rates(at, *held) + (k1 - k2) / h)
        at = at + k3
        return at + jax.scipy.linalg.lu_solve(factors, rates(at, *held) + (k1 - k2 - 8.0 / 3.0 * k3) / h)

    def one(state: Any, index: Any) -> Any:
        held = drive(state, index)
        return jax.lax.fori_loop(0, steps, lambda _, x: step(x, *held), state)

    each = jax.vmap(one, in_axes=(0, None))
    rest = jnp.zeros((lanes, count))
    nothing = jnp.zeros((task.ticks, *np.shape(seen(rest[0]))))

    def tick(index: Any, carry: Any) -> Any:
        states, kept = carry
        return each(states, index), kept.at[index].set(seen(states[0]))

    @jax.jit
    def loop(ticks: Any) -> Any:
        return jax.lax.fori_loop(0, ticks, tick, (rest, nothing))[1]

    loop(2).block_until_ready()
    return lambda ticks: np.asarray(loop(ticks))[:ticks]
