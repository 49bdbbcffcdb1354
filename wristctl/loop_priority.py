"""A loop that the computer lets run when it is due: real-time scheduling, memory that stays, no garbage collection."""

import ctypes
import gc
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

PRIORITY = 20
"""Of SCHED_FIFO: above every ordinary program, below the kernel's own threads for interrupts (50)."""
BESIDE = 10
"""Of the threads that see to its pictures: one picture takes longer than a tick."""
_CURRENT_AND_FUTURE = 3
"""MCL_CURRENT | MCL_FUTURE of sys/mman.h."""
_SWITCH = 5e-4
"""Seconds after which a thread of ours lets another of them go on."""
_HOW = "how to allow it: documentation: Real time"


@contextmanager
def no_long_pauses() -> Iterator[None]:
    """Within the block garbage collection leaves what is there now alone: all of it takes a tenth of a second."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@contextmanager
def prioritised(wanted: bool) -> Iterator[str]:
    """Within the block this thread, and those that it starts, come first, if that is `wanted`; what was had, in words.

    What the system does not allow is left out, and said. Threads that may keep the loop waiting call `beside_the_loop`.
    """
    with no_long_pauses():
        if not wanted:
            yield ""
            return
        switch, collecting = sys.getswitchinterval(), gc.isenabled()
        had, refused = ["garbage collection off"], list[str]()
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
            if collecting:
                gc.enable()


def beside_the_loop() -> None:
    """Put the calling thread behind a loop that comes first, but still before ordinary programs; else leave it be."""
    with suppress(AttributeError, OSError):
        if os.sched_getscheduler(0) == os.SCHED_FIFO:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(BESIDE))


def as_any_program() -> None:
    """Give back the priority that the calling thread has from the one that started it."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


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
