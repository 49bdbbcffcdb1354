"""The forward model: the angle that a wrist on elastic tendons takes where its spools are moved as recorded.

Candidates run side by side, one a lane: a Jacobian costs a block or two. Actuator and integrator are the simulation's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.wrist import WristParameters
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import ARC_LIMIT
from wristctl.lanes.lane import where
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import TENDON, Drive, pulls
from wristctl.wrist.integrator import step
from wristctl.wrist.segments import load_segments, segments

Array = NDArray[np.float64]

SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest on its first spool positions; on elastic tendons it is fast."""


class SupposedWrist(NamedTuple):
    """A wrist and its tendons as they may be: stiffness of one tendon [N/m], capstan friction.

    `taut` is what each tendon has reeled in more [m] than its spool's count says: two of the + side, two of the -.
    """

    wrist: WristParameters
    tendon_stiffness: float
    friction: float
    taut: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@compiled
def _advance(models: Any, tendons: Any, reeled: Any, h: float, settle: int, state: Any, angle: Any, cut: Any) -> None:
    segment, tendon = load_segments(rows_of(models)), rows_of(tendons)
    drive = Drive(TENDON, 0.0, tendon[0], tendon[1], 0.0, 0.0, 0.0)
    n = len(cut)
    theta, omega = part(rows_of(state), 0, cut), part(rows_of(state), n, cut)
    old_theta = lanes_like(theta)
    zero = 0.0 * tendon[0]
    alive = 1.0 + zero
    for k in range(-settle, reeled.shape[0]):
        now = max(k, 0)
        if k >= 0:
            total = zero
            for i in range(n):
                total = total + theta[i]
            rows_of(angle)[k] = total
        plus, minus = zero, zero
        for pair in range(2):
            ahead, behind = reeled[now, pair] + tendon[2 + pair], reeled[now, 2 + pair] + tendon[4 + pair]
            one, other = pulls(drive, segment, theta, omega, 1.0, ahead, behind)
            plus = plus + one
            minus = minus + other
        for i in range(n):
            old_theta[i] = theta[i]
        step(segment, theta, omega, plus, minus, h + zero)
        for i in range(n):
            alive = where(abs(theta[i]) < ARC_LIMIT, alive, zero)
        for i in range(n):
            theta[i] = where(alive > zero, theta[i], old_theta[i])
            omega[i] = where(alive > zero, omega[i], zero)


def angles(candidates: Sequence[SupposedWrist], reeled: Array, h: float, n: int) -> Array:
    """Bending angles (count, T) [rad] of the candidates, cut into n segments, at steps of h [s].

    `reeled` (T, 4) [m] is what the spools have reeled in since the straight wrist's tendons were taut and free of
    tension, held over each step: two tendons of the + side, then the two of the - side. At first the wrist is at rest.
    A candidate that bends a segment beyond a full turn stays where it was.
    """
    models = to_blocks(np.array([segments(each.wrist, n) for each in candidates]))
    tendons = to_blocks(np.array([[each.tendon_stiffness, each.friction, *each.taut] for each in candidates]))
    found = np.empty((len(models), len(reeled), *models.shape[2:]))
    reeled = np.ascontiguousarray(reeled, float)
    for model, tendon, angle in zip(models, tendons, found, strict=True):
        _advance(model, tendon, reeled, h, round(SETTLE / h), np.zeros((2 * n, *angle.shape[1:])), angle, (0,) * n)
    return to_rows(found, len(candidates))
