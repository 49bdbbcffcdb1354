"""SIGTERM counts as Ctrl-C; where something must come to its end, neither disturbs it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any


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


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Within the block (main thread only) Ctrl-C, where it is not ignored, and SIGTERM raise KeyboardInterrupt."""
    seen = Interrupts()

    def raised(number: int, frame: FrameType | None) -> None:
        seen.asked = True
        raise KeyboardInterrupt

    handlers: dict[signal.Signals, Any] = {signal.SIGTERM: raised}
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        handlers[signal.SIGINT] = raised
    with _handled(handlers):
        yield seen


def undisturbed() -> Any:
    """Within the block (main thread only) Ctrl-C and SIGTERM are ignored."""
    return _handled({signal.SIGINT: signal.SIG_IGN, signal.SIGTERM: signal.SIG_IGN})
