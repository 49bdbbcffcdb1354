"""The task's file and its reference trajectory: SciPy's implicit Radau at 1e-10 on wristctl's equation of motion."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from equations import Segment, pulls
from scipy.integrate import solve_ivp
from task import Task

from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.simulation.reference import motion
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.segments import segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE

GAINS = (20.0, 1.0, 20.0)
"""P1, P2, P3 of the sliding mode law: a calm loop, so that the error measured is the integrator's."""
HORIZON, MOVE, PERIOD = 5.0, 0.8, 1e-3
COMPARED = 1000
"""Ticks of the reference trajectory: the move and what follows it."""


def make_task(n: int) -> Task:
    """A 30 degree minimum-jerk move of the default wrist in n segments at 1 kHz."""
    wrist = WristParameters()
    course = motion(Reference(duration=MOVE), wrist, HORIZON, PERIOD)
    reference = np.stack([course.theta_ref, course.rate_ref, course.acceleration_ref], axis=1)
    limits = TENDONS_PER_SIDE * wrist.pretension, TENDONS_PER_SIDE * wrist.tension_limit
    return Task(n, PERIOD, *limits, segments(wrist, n), segments(wrist, 1), np.array(GAINS), reference, MOVE)


def implicit(task: Task, cache: Path) -> np.ndarray:
    """Tip angle at the first ticks, (COMPARED,) [rad]; kept in the cache folder under a hash of the task."""
    scalars = np.array([task.period, task.low, task.high])
    values = [task.plant, task.model, task.gains, task.reference[:COMPARED], scalars]
    key = hashlib.sha256(b"".join(np.ascontiguousarray(v).tobytes() for v in values)).hexdigest()[:16]
    file = cache / f"implicit-{key}.npy"
    if not file.exists():
        cache.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part.npy")
        np.save(part, _solve(task))
        part.replace(file)
    return np.asarray(np.load(file))


def _solve(task: Task) -> np.ndarray:
    n, model = task.segments, Segment(*map(float, task.model))
    state, seen = np.zeros(2 * n), np.empty(COMPARED)
    for tick in range(COMPARED):
        theta, rate = state[:n].sum(), state[n:].sum()
        seen[tick] = theta
        pull = np.array(pulls(np, model, task.gains, task.low, task.high, theta, rate, task.reference[tick, 0]))

        def slope(_: float, x: np.ndarray, pull: np.ndarray = pull) -> np.ndarray:
            return np.concatenate([x[n:], _acceleration(task, x, pull)])

        def jacobian(_: float, x: np.ndarray, pull: np.ndarray = pull) -> np.ndarray:
            acceleration = _acceleration(task, x, pull)
            by_theta, by_rate = linearised(task.plant, x[:n], x[n:], acceleration, pull)[1:]
            mass = terms(task.plant, x[:n], x[n:]).mass
            lower = -np.linalg.solve(mass, np.hstack([by_theta, by_rate]))
            return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])

        done = solve_ivp(slope, (0.0, task.period), state, "Radau", rtol=1e-10, atol=1e-12, jac=jacobian)
        state = done.y[:, -1]
    return seen


def _acceleration(task: Task, x: np.ndarray, pull: np.ndarray) -> np.ndarray:
    n = task.segments
    zero = np.zeros(n)
    residual, _, _ = linearised(task.plant, x[:n], x[n:], zero, pull)
    return np.asarray(-np.linalg.solve(terms(task.plant, x[:n], x[n:]).mass, residual))
