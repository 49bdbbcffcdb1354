"""A loop that the computer lets run when it is due: real-time scheduling, memory that stays, no garbage collection."""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

PRIORITY = 20
"""Of SCHED_FIFO: above every ordinary program, below the kernel's own threads for interrupts (50)."""
_CURRENT_AND_FUTURE = 3
"""MCL_CURRENT | MCL_FUTURE of sys/mman.h."""
_SWITCH = 5e-4
"""Seconds after which a thread of ours lets another of them go on."""
_HOW = "docs/hardware/real-time.md says how to allow it"


@contextmanager
def prioritised(wanted: bool) -> Iterator[str]:
    """Within the block this thread, and those that it starts, come first, if that is `wanted`; what was had, in words.

    What the system does not allow is left out, and said.
    """
    if not wanted:
        yield ""
        return
    switch, collecting = sys.getswitchinterval(), gc.isenabled()
    had, refused = ["garbage collection off"], list[str]()
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(_SWITCH)
    before = _first_in_line()
    (had if before is not None else refused).append(f"SCHED_FIFO {PRIORITY}")
    locked = _memory_locked()
    (had if locked else refused).append("locked memory")
    try:
        yield f"priority: {', '.join(had)}" + (f"; not allowed: {', '.join(refused)} ({_HOW})" if refused else "")
    finally:
        if before is not None:
            os.sched_setscheduler(0, *before)
        if locked:
            _libc().munlockall()
        sys.setswitchinterval(switch)
        gc.unfreeze()
        if collecting:
            gc.enable()


def _first_in_line() -> tuple[int, os.sched_param] | None:
    """Real-time scheduling; what was so before, None where it is not to be had."""
    with suppress(AttributeError, OSError):
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        return before
    return None


def _memory_locked() -> bool:
    """Keep all memory from being swapped out, where there is no limit to that: beyond one no more could be had."""
    with suppress(AttributeError, OSError):
        unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
        return (unlimited or os.geteuid() == 0) and _libc().mlockall(_CURRENT_AND_FUTURE) == 0
    return False


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
