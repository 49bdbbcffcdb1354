"""SIGTERM counts as Ctrl-C; where something must come to its end, neither disturbs it."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

_SOON = 0.01
"""Seconds in which a destructor or callback has ended."""


@contextmanager
def _handled(handlers: dict[signal.Signals, Any]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@dataclass
class Interrupts:
    """Whether Ctrl-C or SIGTERM has come: whoever compiles or builds a model meanwhile may raise another error."""

    asked: bool = False


_around: list[Interrupts] = []
"""Blocks that the main thread has entered, the innermost last."""


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Within the block (main thread only) Ctrl-C, where it is not ignored, and SIGTERM raise KeyboardInterrupt.

    One that falls into a destructor or a callback is swallowed by the interpreter, which tells only
    `sys.unraisablehook`: with `again` for that hook it comes once more. One that a library swallows, as while it is
    imported, is known from `asked`, which a block within a block shares.
    """
    if threading.current_thread() is not threading.main_thread():
        yield Interrupts()
        return
    seen = _around[-1] if _around else Interrupts()

    def raised(number: int, frame: FrameType | None) -> None:
        seen.asked = True
        raise KeyboardInterrupt

    handlers: dict[signal.Signals, Any] = {signal.SIGTERM: raised, signal.SIGALRM: raised}
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        handlers[signal.SIGINT] = raised
    with _handled(handlers):
        _around.append(seen)
        try:
            yield seen
        finally:
            _around.pop()


@contextmanager
def deferred() -> Iterator[None]:
    """Within the block, which must be short, Ctrl-C and SIGTERM wait; they come at its end.

    Processes that begin in it begin with both blocked. Another thread may be given the signal meanwhile: Python
    would handle it here all the same.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    noted: dict[signal.Signals, Any] = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            noted[number] = lambda number, frame: came.append(number)
    try:
        with _handled(noted):
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
    finally:
        for each in dict.fromkeys(came):
            signal.raise_signal(each)


def asked() -> bool:
    """Whether Ctrl-C or SIGTERM has come, also where a library has made another error of it."""
    return bool(_around) and _around[-1].asked


def from_outside(error: BaseException) -> bool:
    """Whether an exception is Ctrl-C or SIGTERM, and not a KeyboardInterrupt that some code has raised by itself."""
    heard = _around[-1].asked if _around else signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and heard


def undisturbed() -> Any:
    """Within the block (main thread only) Ctrl-C and SIGTERM are ignored."""
    return _handled(dict.fromkeys((signal.SIGINT, signal.SIGTERM, signal.SIGALRM), signal.SIG_IGN))


def again(told: sys.UnraisableHookArgs) -> None:
    """Raise again, later, an interrupt that a finaliser swallowed: `sys.unraisablehook` within `interrupts`."""
    if told.exc_type is KeyboardInterrupt:
        signal.setitimer(signal.ITIMER_REAL, _SOON)
    else:
        sys.__unraisablehook__(told)
