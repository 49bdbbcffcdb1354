"""Processes that work for another: they begin with no module of the working directory, and end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable that keeps Python from looking for modules where it begins."""


@contextmanager
def safe_path() -> Iterator[None]:
    """Within the block Python begins processes, its own helpers too, that look for no module in the working directory.

    Else a file there with the name of one of Python's own modules would run in each of them.
    """
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(SAFE_PATH, None)
        else:
            os.environ[SAFE_PATH] = before


def serve_parent() -> None:
    """Leave Ctrl-C to the parent, and end with it: a parent that was killed tells nobody."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
