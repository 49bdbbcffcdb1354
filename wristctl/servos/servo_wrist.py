"""Simulated servos with spools that pull an elastic wrist in two planes, in steps of some 0.1 ms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.wrist.plant import advance_or_stop, bend_of, kernel_of, parameters_of, path_before
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE, placed_values
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import ElasticTendons, shortening

# Longest step of the integration [s], and segments of the simulated wrist.
_STEP, _SEGMENTS = 0.25e-3, 4
# Speed [m/s] at which gear friction has half its size: below it a gear creeps rather than sticks.
_CREEP = 1e-4
# Of a servo's output, as felt at its horn: inertia [kg m2], stiffness of its loop with the maker's P gain [N m/rad],
# damping of the loop and of the gear alone [N m s/rad], friction [N m]. Assumed: such a loop lags by 16 ms.
_INERTIA, _LOOP, _BRAKE, _GEAR, _FRICTION = 4e-3, 40.0, 0.64, 0.05, 0.015
# Values of a servo, along its tendon [SI]: where its spool is and how fast, its goal, its largest force, stiffness and
# damping of its loop, damping and friction of its gear, its mass; and what is 1 or 0: free to turn, its tendon on,
# its loop closed.
PLACE, SPEED, GOAL, MOST, LOOP, BRAKE, GEAR, FRICTION, MASS, FREE, ATTACHED, CLOSED = range(12)
_VALUES = 12


def _follow(
    model: Any, values: Any, stiffness: Any, servos: Any, state: Any, out: Any, sizes: Any, span: Any
) -> None:  # fmt: skip
    (cut, pulls), (steps, h) = sizes, span
    plant, count, m = parameters_of(model, rows_of(values), pulls), len(pulls), len(cut)
    row, result = rows_of(servos), rows_of(out)
    q, rate = part(rows_of(state), 0, cut), part(rows_of(state), m, cut)
    tendons = ElasticTendons(part(rows_of(stiffness), 0, pulls), pulls)
    reeled, zero = lanes_like(tendons.stiffness), zero_like(q[0])
    for _ in range(steps):
        path = path_before(tendons, plant, q)
        for t in range(count):
            k = _VALUES * t
            x, place, speed = shortening(path, t), row[k + PLACE], row[k + SPEED]
            pull = row[k + ATTACHED] * tendons.stiffness[t] * maximum(0.0, place - x)
            asked = row[k + LOOP] * (row[k + GOAL] - place) - row[k + BRAKE] * speed
            force = row[k + CLOSED] * clip(asked, -row[k + MOST], row[k + MOST])
            rubs = row[k + FRICTION] * speed / (abs(speed) + _CREEP) + row[k + GEAR] * speed
            speed = row[k + FREE] * (speed + h * (force - pull - rubs) / row[k + MASS])
            row[k + SPEED] = speed
            row[k + PLACE] = place + h * speed
            reeled[t] = where(row[k + ATTACHED] > zero, row[k + PLACE], x - 1.0)
            result[t] = pull
            result[count + t] = force
        advance_or_stop(plant, q, rate, reeled, tendons, h + zero, 1.0 + zero)
    bend, speed = lanes_like(part(q, 0, (0, 0))), lanes_like(part(q, 0, (0, 0)))
    bend_of(plant, q, rate, bend, speed)
    result[2 * count] = bend[0]
    result[2 * count + 1] = bend[1]


class ServoWrist:
    """Servos in the order of a wrist's tendons, each with a spool of this radius [m], at rest with slack [m] tendons.

    `wrist` has the tendons' places, `stiffness` is that of each tendon [N/m].
    """

    def __init__(self, wrist: WristParameters, spool_radius: float, stiffness: float, slack: float) -> None:
        layout = TendonLayout.of(wrist)
        count = len(layout.places)
        self.values = np.zeros((count, _VALUES))
        """Values of each servo (T, 12)."""
        square = spool_radius**2
        for column, each in (
            (PLACE, -slack), (GOAL, -slack), (MOST, 0.0), (LOOP, _LOOP / square), (BRAKE, _BRAKE / square),
            (GEAR, _GEAR / square), (FRICTION, _FRICTION / spool_radius), (MASS, _INERTIA / square), (FREE, 1.0),
            (ATTACHED, 1.0), (CLOSED, 0.0),
        ):  # fmt: skip
            self.values[:, column] = each
        self._wrist = placed_values(wrist, layout, _SEGMENTS)
        self._stiffness, self._state = np.full(count, stiffness), np.zeros(4 * _SEGMENTS)
        self._out, self._kernel = np.zeros(2 * count + 2), kernel_of(_follow, PCC_IN_SPACE)

    @property
    def pull(self) -> Array:
        """Tension of each tendon (T,) [N]."""
        return self._out[: len(self.values)]

    @property
    def force(self) -> Array:
        """Force of each motor along its tendon (T,) [N]."""
        return self._out[len(self.values) : -2]

    @property
    def bend(self) -> Array:
        """Bend of the last disc (2,) [rad]."""
        return self._out[-2:].copy()

    def advance(self, seconds: float) -> None:
        """Let so much time pass."""
        steps = max(1, math.ceil(seconds / _STEP - 1e-9))
        cut, pulls = (0,) * (2 * _SEGMENTS), (0,) * len(self.values)
        self._kernel(
            PCC_IN_SPACE, self._wrist, self._stiffness, self.values.reshape(-1), self._state, self._out, (cut, pulls),
            (steps, seconds / steps),
        )  # fmt: skip
