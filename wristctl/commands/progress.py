"""Progress of a task: counted for a display, noted in the run's events, logged in the end."""

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

from wristctl.commands.printed_table import number
from wristctl.commands.session import Done, Event, ShowProgress

log = logging.getLogger(__name__)

# Called with what goes on, how much of it is done, of how much (None: unknown), and figures beside it.
Watch = Callable[[str, int, int | None, Mapping[str, float]], None]

# Time between two events [s].
_EVENT_EVERY = 1.0
# Time after which a pace is meaningful [s].
_TELLS = 2.0
# Time from which a step has a line of the log, unless details are asked for [s].
_LONG = 1.0


@dataclass
class Count:
    """Progress of a task, and the figures beside it."""

    what: str
    total: int | None
    unit: str
    count: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    began: float = field(default_factory=lambda: time.monotonic())
    kept: int = 0
    """Part of the count that an earlier run had done, which says nothing of the pace."""

    def seconds_left(self) -> float | None:
        """Time left at the pace so far [s]; None where it is unknown, or all is done."""
        passed = time.monotonic() - self.began
        if self.total is None or not self.kept < self.count < self.total or passed < _TELLS:
            return None
        return passed * (self.total - self.count) / (self.count - self.kept)

    def remaining(self) -> str:
        """Time left in words; empty where it is unknown."""
        left = self.seconds_left()
        return "" if left is None else f"about {duration(left)} left"

    def beside(self) -> str:
        """The figures as text."""
        return ", ".join(f"{name} {number(float(value))}" for name, value in self.figures.items())

    def line(self) -> str:
        """Progress and figures as text."""
        of = "" if self.total is None else f" of {self.total}"
        counted = f"{self.count}{of} {self.unit}".rstrip() if self.count else ""
        shown = ", ".join(part for part in (counted, self.beside()) if part)
        return f"{self.what}: {shown}" if shown else self.what

    def fields(self) -> dict[str, Any]:
        """Progress and figures as fields of an event."""
        return {"what": self.what, "total": self.total, "count": self.count, **self.figures}


@contextmanager
def counting(event: Event, task: str, total: int | None, unit: str, show: Callable[[Count], None]) -> Iterator[Done]:
    """Count while a block works: each call is shown, and at most one a second is an event.

    In the end one line of the log names the step and its time; of a step shorter than a second it is a detail.

    Parameters
    ----------
    event
        Function that notes an event; the end is one.
    task
        Name of the task.
    total
        Length of the task in `unit`; None where it is unknown.
    unit
        Unit of the count.
    show
        Display of the count.
    """
    state = Count(task, total, unit)
    last_event = state.began - _EVENT_EVERY

    def done(count: int = 0, kept: int = 0, **figures: float) -> None:
        nonlocal last_event
        state.count, state.kept = count, kept
        state.figures |= figures
        show(state)
        instant = time.monotonic()
        if instant - last_event >= _EVENT_EVERY:
            last_event = instant
            event("progress", **state.fields())

    yield done
    event("progress", **state.fields())
    passed = time.monotonic() - state.began
    log.log(logging.INFO if passed >= _LONG else logging.DEBUG, "%s, %.1f s", state.line(), passed)


def duration(seconds: float) -> str:
    """A time as a person says it: 12 s, 4 min, 3 h."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"


def watched(watch: Watch | None) -> ShowProgress:
    """Progress for a script or notebook: nothing is printed, and `watch` is called at the start and at every step."""

    def show(count: Count) -> None:
        if watch is not None:
            watch(count.what, count.count, count.total, dict(count.figures))

    def shown(event: Event, task: str, total: int | None, unit: str) -> AbstractContextManager[Done]:
        show(Count(task, total, unit))
        return counting(event, task, total, unit, show)

    return shown


def no_event(*_kind: object, **_fields: object) -> None:
    """For whatever keeps no journal."""
