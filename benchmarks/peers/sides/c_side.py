"""The plain loop in C, compiled for this machine, with as many lanes side by side as C_LANES says."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from compile_c import compiled
from task import Task

from wristctl.lanes.series import E2, E3

SUMS = 19
_DOUBLES = ctypes.POINTER(ctypes.c_double)
_ARRAYS = ("reference", "gains", "state", "sums", "record")


class _Work(ctypes.Structure):
    """struct work of loop.cpp."""

    _fields_ = [
        *((name, _DOUBLES) for name in ("plant", "model")),
        *((name, ctypes.c_double) for name in ("low", "high", "last", "move", "rest", "horizon")),
        *((name, _DOUBLES) for name in _ARRAYS),
        ("period", ctypes.c_double),
        *((name, ctypes.c_int) for name in ("rollouts", "ticks", "substeps", "next")),
    ]


def _library(segments: int, width: int) -> ctypes.CDLL:
    series = [f"-DSERIES{k}=" + ",".join(map(repr, s)) for k, s in ((2, E2), (3, E3))]
    options = (f"-DSEGMENTS={segments}", f"-DLANES={width}", *series)
    return compiled("loop.cpp", Path(os.environ["PEERS_CACHE"]), options)


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One lane runs in a build one lane wide."""
    library = _library(task.segments, 1 if lanes == 1 else int(os.environ["C_LANES"]))
    final = float(task.reference[-1, 0])

    def run(ticks: int) -> np.ndarray:
        arrays = {
            "plant": task.plant, "model": task.model, "reference": np.ascontiguousarray(task.reference),
            "gains": np.tile(task.gains, (lanes, 1)), "state": np.empty((lanes, 2 * task.segments)),
            "sums": np.empty((lanes, SUMS)), "record": np.empty(ticks),
        }  # fmt: skip
        pointers = {name: array.ctypes.data_as(_DOUBLES) for name, array in arrays.items()}
        work = _Work(
            low=task.low, high=task.high, last=final, move=abs(final), rest=task.rest, horizon=ticks * task.period,
            period=task.period, rollouts=lanes, ticks=ticks, substeps=steps, **pointers,
        )  # fmt: skip
        library.run(ctypes.byref(work), threads)
        return arrays["record"]

    return run
