"""Progress of a task: counted for a display, noted in the run's events, logged in the end."""

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

from wristctl.commands.printed_table import number
from wristctl.commands.session import Done, Event, ShowProgress
from wristctl.lanes.compile_time import COMPILE_TIME
from wristctl.processes import crowding

log = logging.getLogger(__name__)

# Called with what goes on, how much of it is done, of how much (None: unknown), and figures beside it.
Watch = Callable[[str, int, int | None, Mapping[str, float]], None]

# Time between two events [s].
_EVENT_EVERY = 1.0
# Time after which a pace is meaningful [s].
_TELLS = 1.0
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
    processor: float = field(default_factory=time.process_time)
    """Processor time of this process when it began [s]."""
    kept: int = 0
    """Part of the count that an earlier run had done, which says nothing of the pace."""
    then: float = 0.0
    """Time that the command takes after this task, as a multiple of the task's own."""
    after: float = 0.0
    """The same in seconds on a machine that does nothing else, of what does not grow with the task."""
    compiled: float = field(default_factory=lambda: COMPILE_TIME.seconds)
    """Seconds that had been spent on compiling when it began."""
    reached: float | None = None
    """Seconds of work until the count was what it is; None: it is so now."""
    step: int = 1
    """What it grew by last: by as much it is taken to grow next."""

    def worked(self) -> float:
        """Seconds since it began in which nothing was compiled."""
        return max(0.0, time.monotonic() - self.began - (COMPILE_TIME.seconds - self.compiled))

    def seconds_left(self) -> float | None:
        """Time left of the command at the pace so far [s]; None where it is unknown, or all is done.

        Between two counts the pace is that of the last one, until the next is overdue.
        """
        passed, whole = self.worked(), (self.total or 0) - self.kept
        count = self.count - self.kept
        if not 0 < count <= whole or passed < _TELLS or (count == whole and not self.then + self.after):
            return None
        reached = passed if self.reached is None else self.reached
        following = min(count + self.step, whole)
        task = reached if count == whole else max(reached * whole / count, passed * whole / following)
        longer = crowding(time.monotonic() - self.began, time.process_time() - self.processor)
        return task * (1.0 + self.then) + self.after * longer - passed

    def remaining(self) -> str:
        """Time left in words; empty where it is unknown."""
        return left_words(self.seconds_left())

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
def counting(
    event: Event,
    task: str,
    total: int | None,
    unit: str,
    show: Callable[[Count], None],
    then: float = 0.0,
    after: float = 0.0,
) -> Iterator[Done]:
    """Count while a block works: each call is shown, and at most one a second is an `event`, as is the end.

    In the end one line of the log names the step and its time; of a step shorter than a second it is a detail. The
    command takes `then` times the task's own time after it, and `after` [s] on a machine that does nothing else.
    """
    state = Count(task, total, unit, then=then, after=after)
    last_event = state.began - _EVENT_EVERY

    def done(count: int = 0, kept: int = 0, **figures: float) -> None:
        nonlocal last_event
        if count > state.count:
            state.step = count - state.count
        state.count, state.kept, state.reached = count, kept, state.worked()
        state.figures |= figures
        show(state)
        instant = time.monotonic()
        if instant - last_event >= _EVENT_EVERY:
            last_event = instant
            event("progress", **state.fields())

    show(state)
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


def left_words(seconds: float | None) -> str:
    """Time left in words; empty where it is unknown."""
    return "" if seconds is None else f"about {duration(seconds)} left"


class Ahead:
    """Time left of a command whose tasks follow each other: a task that tells none goes by what those before told."""

    def __init__(self) -> None:
        self._ends: float | None = None

    def seconds_left(self, count: Count) -> float | None:
        """Time left of the command by what the task that goes on tells [s]; None where it is unknown."""
        now, left = time.monotonic(), count.seconds_left()
        if left is not None:
            self._ends = now + left
        return None if self._ends is None or self._ends - now < 0.5 else self._ends - now


def watched(watch: Watch | None) -> ShowProgress:
    """Progress for a script or notebook: nothing is printed, and `watch` is called at the start and at every step."""

    def show(count: Count) -> None:
        if watch is not None:
            watch(count.what, count.count, count.total, dict(count.figures))

    def shown(
        event: Event, task: str, total: int | None, unit: str, then: float = 0.0, after: float = 0.0
    ) -> AbstractContextManager[Done]:
        return counting(event, task, total, unit, show, then, after)

    return shown


def no_event(*_kind: object, **_fields: object) -> None:
    """For whatever keeps no journal."""
