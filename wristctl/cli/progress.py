"""Messages and progress on stderr: live on a terminal, plain lines elsewhere."""

import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Self

from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

from wristctl.commands.progress import Ahead, Count, counting, duration, left_words, no_event
from wristctl.commands.session import Done, Event
from wristctl.escape import printable_lines
from wristctl.lanes.compile_time import COMPILE_TIME

# Keywords with which the console prints text that is not rich's markup.
PLAIN: dict[str, Any] = {"markup": False, "emoji": False, "highlight": False, "soft_wrap": True}

# What goes on between two tasks, and after the last one: what was found is written.
_BETWEEN = "writing"
# What is said of a step instead of the time that is left.
_COMPILING = "compiling, once"
# Seconds after which a step that is not over has a plain line; each line later doubles the time, up to the most.
_FIRST_LINE, _LINE_EVERY = 10.0, 300.0


class Terminal(Console):
    """stderr. What is drawn there live gives way while a person is asked something."""

    _live_now: Live | None = None

    def on_broken_pipe(self) -> None:
        """Stop to show progress once the reader of the stream is gone. The command goes on."""
        self.quiet = True
        with suppress(OSError, ValueError):
            devnull = os.open(os.devnull, os.O_WRONLY)
            os.dup2(devnull, sys.stderr.fileno())
            os.close(devnull)

    def set_live(self, live: Live) -> Any:
        """Something begins to be drawn, in place of what was: lives are not nested."""
        if self._live_now is not None:
            self._live_now.stop()
        self._live_now = live
        return super().set_live(live)

    def clear_live(self) -> None:
        """End the live display."""
        self._live_now = None
        super().clear_live()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Within the block nothing is drawn live: it would hide a question, and what is typed in answer."""
        live = self._live_now
        if live is not None:
            live.stop()
        try:
            yield
        finally:
            if live is not None:
                live.start()


class Messages(logging.Handler):
    """wristctl's log messages on stderr, above a live progress line where there is one."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self._console = console

    def emit(self, record: logging.LogRecord) -> None:
        """Print one message; from warnings on with its level."""
        level = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        self._console.print(level + printable_lines(record.getMessage()), **PLAIN)


@contextmanager
def listening(quiet: bool, verbose: bool) -> Iterator[Terminal]:
    """Within the block wristctl's messages go to stderr: warnings only if quiet, details too if verbose."""
    console = Terminal(stderr=True)
    handler, logger = Messages(console), logging.getLogger("wristctl")
    logger.addHandler(handler)
    logger.setLevel(logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO)
    try:
        yield console
    finally:
        logger.removeHandler(handler)


class Bar:
    """The one live line of a command, whose tasks follow each other; off a terminal plain lines.

    Its bar is the share of the whole command, as far as that can be told. Off a terminal a task that takes long has a
    line after 10 s, 20 s, 40 s and so on, of which the first that compiles says so.
    """

    def __init__(self, console: Console, quiet: bool) -> None:
        self._console, self._began, self._ahead = console, time.monotonic(), Ahead()
        self._live, self._lines = console.is_terminal and not quiet, not (console.is_terminal or quiet)
        self._bar = Progress(
            SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), _Left(self._left),
            console=console, transient=True, disable=not self._live,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=None)
        self._count, self._compiles_told = Count("", None, ""), False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    @contextmanager
    def __call__(
        self, event: Event, task: str, total: int | None, unit: str, then: float = 0.0, after: float = 0.0
    ) -> Iterator[Done]:
        """Show the progress of a task; yields `done(count, **figures)`, to be called as often as one likes."""
        over = threading.Event()
        if self._lines:
            threading.Thread(target=self._tell, args=(over,), daemon=True).start()
        try:
            with counting(event, task, total, unit, self._show, then, after) as advance:
                self._bar.start()
                yield advance
        finally:
            over.set()
            self._show(Count(_BETWEEN, None, ""))

    def _tell(self, over: threading.Event) -> None:
        passed = 0.0
        for wait in _waits():
            if over.wait(wait):
                return
            passed += wait
            left = self._left()
            if left == _COMPILING:
                left, self._compiles_told = "" if self._compiles_told else left, True
            self._console.print(f"{self._count.line()}, {left or f'{duration(passed)} so far'}", **PLAIN)

    def _show(self, count: Count) -> None:
        self._count, left = count, self._ahead.seconds_left(count)
        self._bar.update(self._task, description=count.line())
        if left is not None:
            passed = time.monotonic() - self._began
            self._bar.update(self._task, total=1.0, completed=passed / (passed + left))

    def _left(self) -> str:
        return _COMPILING if COMPILE_TIME.goes_on else left_words(self._ahead.seconds_left(self._count))


class _Left(ProgressColumn):
    """What is left, as it is when it is drawn."""

    def __init__(self, told: Callable[[], str]) -> None:
        super().__init__()
        self._told = told

    def render(self, task: Task) -> Text:
        """The words."""
        return Text(self._told())


@contextmanager
def progress(console: Console, activity: str, quiet: bool, total: int | None = None, unit: str = "") -> Iterator[Done]:
    """Show the progress of a command that has one task and makes no run."""
    with Bar(console, quiet) as bar, bar(no_event, activity, total, unit) as advance:
        yield advance


def _waits() -> Iterator[float]:
    """Seconds to each plain line of a step from the one before."""
    wait, passed = _FIRST_LINE, 0.0
    while True:
        yield wait
        passed += wait
        wait = min(passed, _LINE_EVERY)
