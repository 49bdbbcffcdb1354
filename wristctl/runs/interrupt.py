"""SIGTERM counts as Ctrl-C, and neither may disturb the sealing of a run."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
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


def sigterm_as_interrupt() -> Any:
    """Within the block (main thread only) SIGTERM raises KeyboardInterrupt."""
    return _handled({signal.SIGTERM: signal.default_int_handler})


def undisturbed() -> Any:
    """Within the block (main thread only) Ctrl-C and SIGTERM are ignored."""
    return _handled({signal.SIGINT: signal.SIG_IGN, signal.SIGTERM: signal.SIG_IGN})
