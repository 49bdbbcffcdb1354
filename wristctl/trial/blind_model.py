"""The wrist as its spools alone should have it: what the marker is compared with."""

import math
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import rows_of
from wristctl.simulation.actuator import drive_of
from wristctl.simulation.observer import predict
from wristctl.simulation.stationary_filter import Belief, observer_of
from wristctl.wrist.segments import load_segments, segments

# Ticks.
_REMEMBERED = 256
# Seconds for which a spool's length may be taken to stand still: a wrist of 300 deg/s goes on by 0.4 deg meanwhile.
_STILL = 2.5e-3


class BlindModel:
    """Two one-segment wrists at rest at zero: with tendons as believed, and with the softest that there may be.

    Tendons that are softer than believed bend a wrist less; what is true lies between the two. Ticks are numbered from
    0, `period` [s] apart.
    """

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, softest: float, sensor: Sensor, period: float
    ) -> None:
        soft = actuator.model_copy(update={"tendon_stiffness": min(softest, actuator.tendon_stiffness)})
        self._drives = [drive_of(parameters) for parameters in (actuator, soft)]
        self._observers = [observer_of(Belief(sensor, actuator, wrist, period), 1, 0.0) for _ in self._drives]
        self._model, self._period, self._tick = segments(wrist, 1), period, 0
        self._angles = np.zeros((_REMEMBERED, 2))
        self._parts, self._reeled = max(1, math.ceil(period / _STILL - 1e-9)), np.zeros(2)

    def predict(self, reeled_plus: float, reeled_minus: float) -> None:
        """Go on to the next tick, with the sides reeled in by so much [m] until then, evenly since the last one."""
        self._tick += 1
        before, self._reeled = self._reeled, np.array([reeled_plus, reeled_minus])
        for k, (observer, drive) in enumerate(zip(self._observers, self._drives, strict=True)):
            for part in range(self._parts):
                plus, minus = before + (part + 0.5) / self._parts * (self._reeled - before)
                _predict(observer, drive, self._model, plus, minus, self._period / self._parts)
            self._angles[self._tick % _REMEMBERED, k] = observer.now[0]

    def angles(self, time: float) -> Array:
        """Predicted angles (2,) [rad] `time` seconds after tick 0, as far as they are remembered."""
        tick = min(max(math.floor(time / self._period), self._tick - _REMEMBERED + 1), self._tick)
        share = min(max(time / self._period - tick, 0.0), 1.0)
        before, after = self._angles[tick % _REMEMBERED], self._angles[min(tick + 1, self._tick) % _REMEMBERED]
        between: Array = before + share * (after - before)
        return between


@kernel
def _predict(observer: Any, drive: Any, model: Any, plus: float, minus: float, h: float) -> None:
    believed = load_segments(rows_of(model))
    zero = zero_like(believed.length)
    predict(observer, drive, believed, 0, plus + zero, minus + zero, h)
