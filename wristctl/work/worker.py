"""What a worker does, wherever it is: it shows once that it computes the same as the others, then does units."""

from __future__ import annotations

import platform
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.version import __version__
from wristctl.work.unit import code_digest, function_at

if TYPE_CHECKING:
    import numpy as np

_ONE = threading.Lock()
"""Threads of a worker compile one after the other."""
_passed: set[tuple[str, str]] = set()


class Golden(NamedTuple):
    """Numbers that every worker must be able to compute: a function of a specification that gives their hash.

    What it runs is compiled then, so that no unit waits for it.
    """

    does: str
    spec: Mapping[str, Any]
    expected: str
    version: str
    code: str

    @classmethod
    def here(cls, does: str, spec: Mapping[str, Any]) -> Golden:
        """As this process computes them."""
        return cls(does, spec, str(function_at(does)(spec)), __version__, code_digest())


class Computed(NamedTuple):
    """What a unit gave, where, and how long that took [s], by the clock and of the processor."""

    arrays: dict[str, np.ndarray]
    host: str
    seconds: float
    processor: float


class WorkerDiffers(Exception):
    """A worker that would compute other numbers."""


def compute(does: str, spec: Mapping[str, Any], golden: Golden | None) -> Computed:
    """Compute a unit. Raises WorkerDiffers before, where this worker is not of the same code or numbers."""
    host = platform.node()
    if golden is not None:
        _check(golden, host)
    start, processor = time.perf_counter(), time.process_time()
    try:
        arrays = function_at(does)(spec)
    except Exception as error:
        error.add_note(f"on {host}")
        raise
    return Computed(arrays, host, time.perf_counter() - start, time.process_time() - processor)


def _check(golden: Golden, host: str) -> None:
    """Compare once in a process what it is and what it computes."""
    with _ONE:
        if (golden.expected, golden.code) in _passed:
            return
        if (golden.version, golden.code) != (__version__, code_digest()):
            same = "of the same number and other files" if golden.version == __version__ else f"{golden.version} here"
            raise WorkerDiffers(f"the worker on {host} runs wristctl {__version__}, {same}")
        found = str(function_at(golden.does)(golden.spec))
        if found != golden.expected:
            numbers = f"its golden rollout is {found[:12]} and not {golden.expected[:12]}"
            raise WorkerDiffers(f"the worker on {host} ({platform.machine()}) computes other numbers: {numbers}")
        _passed.add((golden.expected, golden.code))
