"""A law whose rate is the difference of two angles, as where nothing measures the rate."""

from dataclasses import replace
from functools import cache
from typing import Any

from wristctl.control.law import NOW, Controller
from wristctl.lanes.compiled import compiled

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

    return _kept_nowhere(law)


@cache
def _law_of_both_planes(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
        for p in range(len(torque)):
            _difference(now[p], memory[p], last)
        inner(now, wrist, gains, memory, tendons, torque)

    return _kept_nowhere(law)


def _kept_nowhere(law: Any) -> Any:
    # What it encloses is not part of its source: under a name that is no file, nothing compiled of it is kept.
    law.__code__ = law.__code__.replace(co_filename="<differenced>")
    return law
