"""One control tick, in simulation and on hardware: what the law sees, its torque, and the pulls that give it."""

from __future__ import annotations

from typing import Any, NamedTuple

from wristctl.control.law import NOW, now_of, wrist_of
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import rows_of
from wristctl.wrist.allocation import allocate, reach

_THETA, _RATE, _THETA_REF, _RATE_REF, _ACCELERATION_REF, _LOW, _HIGH, _PERIOD = range(len(NOW))


class Controlled(NamedTuple):
    """A law with the arrays that it works on: what it sees (NOW), the controller's one-segment wrist (Segments), its
    gains, its memory, and the reference (angle, rate, acceleration)."""

    law: Any
    signals: Any
    model: Any
    gains: Any
    memory: Any
    reference: Any


@compiled
def respond(control: Any, known: Any, angle: Any, rate: Any, bounds: Any, since: float, period: float) -> Any:
    """Torque that the law wants [N m], the least and largest in reach, and pulls of the + and the - side [N].

    `angle` and `rate` are as measured; the reference is what it was `since` seconds ago, continued by its own
    derivatives; `bounds` are the least and the largest pull of a side. `known` is the controller's wrist as Segments.
    """
    low, high = bounds
    signals, target = rows_of(control.signals), rows_of(control.reference)
    torque_low, torque_high = reach(angle, known, low, high)
    signals[_THETA] = angle
    signals[_RATE] = rate
    signals[_THETA_REF] = target[0] + since * (target[1] + 0.5 * since * target[2])
    signals[_RATE_REF] = target[1] + since * target[2]
    signals[_ACCELERATION_REF] = target[2]
    signals[_LOW] = torque_low
    signals[_HIGH] = torque_high
    signals[_PERIOD] = period + 0.0 * low
    gains, memory = rows_of(control.gains), rows_of(control.memory)
    wanted = control.law(now_of(control.signals), wrist_of(control.model), gains, memory)
    plus, minus = allocate(angle, known, wanted, low, high)
    return wanted, torque_low, torque_high, plus, minus
