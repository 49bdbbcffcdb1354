"""Pinocchio: the rigid chain with integrator and law in Python, rollout after rollout."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import scalars
from equations import Segment, pulls, torque
from task import Task


def _model(task: Task) -> pin.Model:
    length, mass, hand, beyond, gx, gy = map(float, task.plant[:6])
    model = pin.Model()
    model.gravity = pin.Motion(np.array([gx, gy, 0.0]), np.zeros(3))
    joint = 0
    for k in range(task.segments):
        place = pin.SE3(np.eye(3), np.array([length if k else 0.5 * length, 0.0, 0.0]))
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"hinge{k}")
        last = k == task.segments - 1
        at = np.array([0.5 * length + beyond if last else length, 0.0, 0.0])
        model.appendBodyToJoint(joint, pin.Inertia(hand if last else mass, at, np.zeros((3, 3))), pin.SE3.Identity())
    return model


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One thread, whatever `threads` says: the loop is Python's."""
    model, known = _model(task), Segment(*map(float, task.model))
    data, h, n = model.createData(), task.period / steps, task.segments
    stiffness, damping = float(task.plant[8]), float(task.plant[9])
    gains, wanted = [float(g) for g in task.gains], [float(r) for r in task.reference[:, 0]]

    resist, spring = h * damping * np.eye(n), h * stiffness * np.eye(n)

    def explicit(q: np.ndarray, v: np.ndarray, drive: float) -> tuple[np.ndarray, np.ndarray]:
        """RK4 on forward dynamics."""

        def rates(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            return np.array(pin.aba(model, data, q, v, drive - stiffness * q - damping * v))

        a1 = rates(q, v)
        v2 = v + 0.5 * h * a1
        a2 = rates(q + 0.5 * h * v, v2)
        v3 = v + 0.5 * h * a2
        a3 = rates(q + 0.5 * h * v2, v3)
        v4 = v + h * a3
        a4 = rates(q + h * v3, v4)
        return q + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)

    def implicit(q: np.ndarray, v: np.ndarray, drive: float) -> tuple[np.ndarray, np.ndarray]:
        """Euler, implicit in springs and dampers: what stays stable for n > 1."""
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        rest = drive - stiffness * q - damping * v - pin.nle(model, data, q, v) - spring @ v
        v = v + h * np.linalg.solve(mass + resist + h * spring, rest)
        return q + h * v, v

    advance = explicit if n == 1 else implicit

    def one(ticks: int) -> np.ndarray:
        q, v, seen = np.zeros(n), np.zeros(n), np.empty(ticks)
        for tick in range(ticks):
            theta = float(q.sum())
            seen[tick] = theta
            plus, minus = pulls(scalars, known, gains, task.low, task.high, theta, float(v.sum()), wanted[tick])
            drive = torque(known, theta, plus, minus)
            for _ in range(steps):
                q, v = advance(q, v, drive)
        return seen

    def run(ticks: int) -> np.ndarray:
        for _ in range(lanes):
            seen = one(ticks)
        return seen

    return run
