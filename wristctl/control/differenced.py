"""A law whose rate is the difference of two angles, as where nothing measures the rate."""

from dataclasses import replace
from functools import cache
from typing import Any

from wristctl.control.law import NOW, Controller
from wristctl.lanes.compiled import compiled, kept_nowhere

_RATE = NOW.index("rate")


def differenced(controller: Controller) -> Controller:
    """Copy of a controller whose rate is the angle's change over the last period over that period (none at the start).

    It remembers one angle more, and begins straight.
    """
    made = _law if controller.planes == 1 else _law_of_both_planes
    return replace(controller, law=made(controller.law, controller.memory), memory=controller.memory + 1)


@compiled
def _difference(now: Any, memory: Any, last: int) -> None:
    now[_RATE] = (now.theta - memory[last]) / now.period
    memory[last] = now.theta


@cache
def _law(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        _difference(now, memory, last)
        return inner(now, wrist, gains, memory)

    return kept_nowhere(law)


@cache
def _law_of_both_planes(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
        for p in range(len(torque)):
            _difference(now[p], memory[p], last)
        inner(now, wrist, gains, memory, tendons, torque)

    return kept_nowhere(law)
