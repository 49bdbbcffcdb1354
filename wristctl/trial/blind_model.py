"""The wrist as its spools alone should have it: what the marker is compared with."""

import math
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.response import OF_A_PLANE
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.observer import knowing_in_lanes, known_of_sides, propagate
from wristctl.simulation.stationary_filter import Belief, observer_of
from wristctl.trial.spatial_belief import known_of_axes

# Ticks.
_REMEMBERED = 256
# Seconds for which a spool's length may be taken to stand still: a wrist of 300 deg/s goes on by 0.4 deg meanwhile.
_STILL = 2.5e-3


class _OneSegment:
    """A wrist that bends in one plane, at rest at zero: its spools are the + and the - side's."""

    spools, shape = 2, ()

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, believed: Actuator, sensor: Sensor, period: float
    ) -> None:
        self._known = known_of_sides(wrist, actuator)
        self._observer = observer_of(Belief(sensor, believed, wrist, period), 1, 0.0)

    def advanced(self, reeled: Array, h: float) -> Array:
        """The angle () [rad] after h [s] with spools that hold so much [m]."""
        _propagate(self._known, self._observer.now, np.array(reeled, np.float64), h)
        angle: Array = self._observer.now[0]
        return angle


class _InTwoPlanes:
    """The same in two planes, with a spool for each axis of the board."""

    spools, shape = AXES, (2,)

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, believed: Actuator, sensor: Sensor, period: float
    ) -> None:
        self._known, self._x = known_of_axes(wrist, actuator), np.zeros(2 * OF_A_PLANE)

    def advanced(self, reeled: Array, h: float) -> Array:
        """The bend (2,) [rad] after h [s] with spools that hold so much [m]."""
        _propagate(self._known, self._x, np.array(reeled, np.float64), h)
        bend: Array = self._x[::OF_A_PLANE]
        return bend


class BlindModel:
    """Two one-segment wrists at rest at zero: with tendons as believed, and with the softest that there may be.

    Tendons that are softer than believed bend a wrist less; what is true lies between the two. Ticks are numbered from
    0, `period` [s] apart. Of a wrist in two planes an angle is its bend (2,).
    """

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, softest: float, sensor: Sensor, period: float, planes: int = 1
    ) -> None:
        soft = actuator.model_copy(update={"tendon_stiffness": min(softest, actuator.tendon_stiffness)})
        kind = _OneSegment if planes == 1 else _InTwoPlanes
        self._wrists = [kind(wrist, parameters, actuator, sensor, period) for parameters in (actuator, soft)]
        self._period, self._tick = period, 0
        self._angles = np.zeros((_REMEMBERED, 2, *kind.shape))
        self._parts, self._reeled = max(1, math.ceil(period / _STILL - 1e-9)), np.zeros(kind.spools)

    def predict(self, *reeled: float) -> None:
        """Go on to the next tick, with spools reeled in by so much [m] until then, evenly since the last one.

        They are those of the + and the - side, or in two planes of the four axes.
        """
        self._tick += 1
        before, self._reeled = self._reeled, np.array(reeled)
        for k, wrist in enumerate(self._wrists):
            for share in range(self._parts):
                held = before + (share + 0.5) / self._parts * (self._reeled - before)
                self._angles[self._tick % _REMEMBERED, k] = wrist.advanced(held, self._period / self._parts)

    def angles(self, time: float) -> Array:
        """Predicted angles (2,), or bends (2, 2), [rad] `time` seconds after tick 0, as far as they are remembered."""
        tick = min(max(math.floor(time / self._period), self._tick - _REMEMBERED + 1), self._tick)
        share = min(max(time / self._period - tick, 0.0), 1.0)
        before, after = self._angles[tick % _REMEMBERED], self._angles[min(tick + 1, self._tick) % _REMEMBERED]
        between: Array = before + share * (after - before)
        return between


@kernel
def _propagate(known: Any, x: Any, reeled: Any, h: float) -> None:
    propagate(knowing_in_lanes(known), rows_of(x), part(rows_of(reeled), 0, known.pulls), h)
