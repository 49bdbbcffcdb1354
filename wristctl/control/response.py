"""One control tick, in simulation and on hardware: what the law sees, its torque, and the pulls that give it."""

from __future__ import annotations

from typing import Any

from wristctl.control.law import NOW
from wristctl.lanes.compiled import compiled
from wristctl.wrist.allocation import allocate, reach

_THETA, _RATE, _THETA_REF, _RATE_REF, _ACCELERATION_REF, _LOW, _HIGH, _PERIOD = range(len(NOW))


@compiled
def respond(
    law: Any, view: Any, signals: Any, seen: Any, known: Any, gain: Any, kept: Any,
    angle: Any, rate: Any, target: Any, since: float, low: Any, high: Any, period: float,
) -> Any:  # fmt: skip
    """Torque that the law wants [N m], the least and largest in reach, and pulls of the + and the - side [N].

    `angle` and `rate` are as measured; `target` (angle, rate, acceleration) is the reference `since` seconds ago,
    continued by its own derivatives; `low` and `high` bound a side's pull. `signals` are the rows behind the law's
    `view`, `seen` and `known` the controller's one-segment wrist as rows and as Segments, `kept` the law's memory.
    """
    torque_low, torque_high = reach(angle, known, low, high)
    signals[_THETA] = angle
    signals[_RATE] = rate
    signals[_THETA_REF] = target[0] + since * (target[1] + 0.5 * since * target[2])
    signals[_RATE_REF] = target[1] + since * target[2]
    signals[_ACCELERATION_REF] = target[2]
    signals[_LOW] = torque_low
    signals[_HIGH] = torque_high
    signals[_PERIOD] = period + 0.0 * low
    wanted = law(view, seen, gain, kept)
    plus, minus = allocate(angle, known, wanted, low, high)
    return wanted, torque_low, torque_high, plus, minus
