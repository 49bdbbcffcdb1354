"""Messages and progress on stderr: live on a terminal, plain lines elsewhere."""

import logging
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)

from wristctl.commands.progress import Count, counting, duration
from wristctl.commands.session import Done, Event
from wristctl.escape import printable_lines

# Keywords with which the console prints text that is not rich's markup.
PLAIN: dict[str, Any] = {"markup": False, "emoji": False, "highlight": False, "soft_wrap": True}

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
        """Something begins to be drawn."""
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


@contextmanager
def progress(
    console: Console, event: Event, activity: str, total: int | None, unit: str, quiet: bool
) -> Iterator[Done]:
    """Show the progress of a step; yields `done(count, **figures)`, to be called as often as one likes.

    Without a `total` the length is unknown. Figures stand beside the count and go to `event`, at most once a second.
    Off a terminal a step that takes long has a line after 10 s, 20 s, 40 s and so on.
    """
    live, lines = console.is_terminal and not quiet, not (console.is_terminal or quiet)
    bar = Progress(*_columns(), console=console, transient=True, disable=not live)
    task = bar.add_task(activity, total=total, figures="", left="")
    over, current = threading.Event(), Count(activity, total, unit)

    def tell() -> None:
        passed = 0.0
        for wait in _waits():
            if over.wait(wait):
                return
            passed += wait
            remaining = current.remaining() or f"{duration(passed)} so far"
            console.print(f"{current.line()}, {remaining}", **PLAIN)

    def show(count: Count) -> None:
        nonlocal current
        current = count
        bar.update(task, completed=count.count, figures=count.beside(), left=count.remaining())

    if lines:
        threading.Thread(target=tell, daemon=True).start()
    try:
        with counting(event, activity, total, unit, show) as advance, bar:
            yield advance
    finally:
        over.set()


def _waits() -> Iterator[float]:
    """Seconds to each plain line of a step from the one before."""
    wait, passed = _FIRST_LINE, 0.0
    while True:
        yield wait
        passed += wait
        wait = min(passed, _LINE_EVERY)


def _columns() -> tuple[ProgressColumn, ...]:
    text, figures = TextColumn("{task.description}"), TextColumn("{task.fields[figures]}")
    passed, left = TimeElapsedColumn(), TextColumn("{task.fields[left]}")
    return SpinnerColumn(), text, BarColumn(), MofNCompleteColumn(), passed, left, figures
