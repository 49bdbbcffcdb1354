"""Threads that Ctrl-C ends soon: only the main thread hears of it, and compiled code of nothing."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event


@contextmanager
def stoppable(workers: int, stop: Event) -> Iterator[ThreadPoolExecutor]:
    """So many threads. Where the block is left by an exception `stop` is set, at which they should look now and then,
    and what waits for one of them is not begun."""
    with ThreadPoolExecutor(workers) as pool:
        try:
            yield pool
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
