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
    return replace(controller, law=_law(controller.law, controller.memory), memory=controller.memory + 1)


@cache
def _law(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        now[_RATE] = (now.theta - memory[last]) / now.period
        memory[last] = now.theta
        return inner(now, wrist, gains, memory)

    # What it encloses is not part of its source: under a name that is no file, nothing compiled of it is kept.
    law.__code__ = law.__code__.replace(co_filename="<differenced>")
    return law
