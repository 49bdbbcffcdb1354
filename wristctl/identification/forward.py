"""The forward model: the angle that a wrist on elastic tendons takes where its spools are moved as recorded.

Candidates run side by side, one a lane: a Jacobian costs a block or two. Actuator and integrator are the simulation's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import TENDON, Drive, Motor, pulls
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import PlantModel, advance_or_stop, kernel_of, parameters_of, tip_angle

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


class Reeled(NamedTuple):
    """What the spools have reeled in (T, 4) [m], held over each step of h [s], and how many steps a wrist has to settle
    on the first of them."""

    lengths: Any
    h: float
    settle: int


def _advance(model: Any, values: Any, tendons: Any, spools: Any, state: Any, angle: Any, cut: Any) -> None:
    plant, tendon = parameters_of(model, rows_of(values)), rows_of(tendons)
    zero = 0.0 * tendon[0]
    drive = Drive(TENDON, Motor(zero, tendon[0], tendon[1], zero, zero, zero))
    n = len(cut)
    q, rate = part(rows_of(state), 0, cut), part(rows_of(state), n, cut)
    alive = 1.0 + zero
    reeled = spools.lengths
    for k in range(-spools.settle, reeled.shape[0]):
        now = max(k, 0)
        if k >= 0:
            total, _ = tip_angle(plant, q, rate)
            rows_of(angle)[k] = total
        plus, minus = zero, zero
        for pair in range(2):
            ahead, behind = reeled[now, pair] + tendon[2 + pair], reeled[now, 2 + pair] + tendon[4 + pair]
            one, other = pulls(drive, plant, q, rate, ahead, behind)
            plus = plus + one
            minus = minus + other
        alive = advance_or_stop(plant, q, rate, plus, minus, spools.h + zero, alive)


def angles(candidates: Sequence[SupposedWrist], reeled: Array, h: float, n: int, model: PlantModel = PCC) -> Array:
    """Bending angles (count, T) [rad] of the candidates, plants of this model cut into n segments, at steps of h [s].

    `reeled` (T, 4) [m] is what the spools have reeled in since the straight wrist's tendons were taut and free of
    tension, held over each step: two tendons of the + side, then the two of the - side. At first the wrist is at rest.
    A candidate that bends a segment beyond a full turn stays where it was.
    """
    values = to_blocks(np.array([model.values(each.wrist, n) for each in candidates]))
    tendons = to_blocks(np.array([[each.tendon_stiffness, each.friction, *each.taut] for each in candidates]))
    found = np.empty((len(values), len(reeled), *values.shape[2:]))
    spools, k = Reeled(np.ascontiguousarray(reeled, float), h, round(SETTLE / h)), model.coordinates(n)
    advance = kernel_of(_advance, model)
    for value, tendon, angle in zip(values, tendons, found, strict=True):
        advance(model, value, tendon, spools, np.zeros((2 * k, *angle.shape[1:])), angle, (0,) * k)
    return to_rows(found, len(candidates))
