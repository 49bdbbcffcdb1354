"""The wrist as its spools alone should have it: what the marker is compared with."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.control.response import OF_A_PLANE
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.observer import knowing_in_lanes, propagate
from wristctl.trial.rig_belief import RigBelief
from wristctl.wrist.tendon_layout import TendonLayout

# Ticks.
_REMEMBERED = 256
# Seconds for which a spool's length may be taken to stand still: a wrist of 300 deg/s goes on by 0.4 deg meanwhile.
_STILL = 2.5e-3


class BlindModel:
    """One-segment wrists at rest at zero: with tendons as believed, with the softest that there may be, and the same
    with the `payload` [kg] that the hand may take up, where there is any.

    Tendons that are softer than believed bend a wrist less, and a load stretches them; what is true lies between all of
    these. Ticks are numbered from 0, `period` [s] apart.
    """

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, softest: float, period: float, planes: Sequence[str],
        layout: TendonLayout | None = None, payload: float = 0.0,
    ) -> None:  # fmt: skip
        soft = actuator.model_copy(update={"tendon_stiffness": min(softest, actuator.tendon_stiffness)})
        hands = [
            wrist.model_copy(update={"hand_mass": wrist.hand_mass + load}) for load in dict.fromkeys((0.0, payload))
        ]
        self._wrists = [
            (RigBelief(hand, tendons, planes, layout).known, np.zeros(OF_A_PLANE * len(planes)))
            for hand in hands
            for tendons in (actuator, soft)
        ]
        self._period, self._tick = period, 0
        self._angles = np.zeros((_REMEMBERED, len(self._wrists), len(planes)))
        self._parts = max(1, math.ceil(period / _STILL - 1e-9))
        self._reeled: Array | float = 0.0

    def predict(self, reeled: Array) -> None:
        """Go on to the next tick, with so much (T,) [m] reeled in at each place until then, evenly since the last."""
        self._tick += 1
        before, self._reeled = self._reeled, reeled
        for k, (known, x) in enumerate(self._wrists):
            for share in range(self._parts):
                held = before + (share + 0.5) / self._parts * (self._reeled - before)
                _propagate(known, x, held, self._period / self._parts)
            self._angles[self._tick % _REMEMBERED, k] = x[::OF_A_PLANE]

    def angles(self, time: float) -> Array:
        """Bends (W, P) [rad] of the wrists `time` seconds after tick 0, as far as they are remembered; that of believed
        tendons and no load is the first."""
        tick = min(max(math.floor(time / self._period), self._tick - _REMEMBERED + 1), self._tick)
        share = min(max(time / self._period - tick, 0.0), 1.0)
        before, after = self._angles[tick % _REMEMBERED], self._angles[min(tick + 1, self._tick) % _REMEMBERED]
        between: Array = before + share * (after - before)
        return between


@kernel
def _propagate(known: Any, x: Any, reeled: Any, h: float) -> None:
    propagate(knowing_in_lanes(known), rows_of(x), part(rows_of(reeled), 0, known.pulls), h)
