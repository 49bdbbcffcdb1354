"""Processes and threads: how many, what ends them, and what they may not touch."""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event

from wristctl.errors import UserError

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


_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


def end_with_parent() -> None:
    """Called in a child process as it begins: SIGTERM when its parent ends, also by SIGKILL (Linux)."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


NO_HARDWARE = "WRISTCTL_NO_HARDWARE"
"""Environment variable that says so, to this process and to all that it begins."""


def check_hardware_allowed(what: str, where: str) -> None:
    """Called by whatever opens a device. Raises UserError where this process may open none."""
    if os.environ.get(NO_HARDWARE):
        fix = f"do it by its own command, with a person at the rig and without {NO_HARDWARE}"
        raise UserError(f"this process opens no {what}", where, fix, exit_code=3)


def cores() -> int:
    """Cores that this process may use; OMP_NUM_THREADS may say fewer, as it does in a worker that shares a machine."""
    there = _there()
    said = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    return max(1, min(there, int(said))) if said.isdigit() else there


def crowding(passed: float, processor: float) -> float:
    """How many times longer this process takes here than alone, as far as it has had its cores lately.

    It had `processor` seconds of them in `passed` ones. It may have waited for something else, as for workers: then it
    is no more than what ran or waited in the last minute, for each core.
    """
    waited = passed * cores() / processor if processor > 0.0 else float("inf")
    return max(1.0, min(waited, os.getloadavg()[0] / _there()))


def _there() -> int:
    """Cores that the system gives this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
