"""The plain loop in two planes in C, compiled for this machine, with as many lanes side by side as C_LANES says."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from fractions import Fraction
from math import factorial
from pathlib import Path

import numpy as np
from compile_c import compiled
from task import BendTask

from wristctl.lanes.series import E2, E3, SERIES_REACH, economised

SUMS = 13
_DOUBLES = ctypes.POINTER(ctypes.c_double)
_INPUTS = ("plant", "believed", "model_y", "model_z", "reference", "gains")
_ARC_REACH = Fraction(1716, 10000)


class _Work(ctypes.Structure):
    """struct work of bends.cpp."""

    _fields_ = [
        *((name, _DOUBLES) for name in (*_INPUTS, "state", "sums", "record")),
        *((name, ctypes.c_double) for name in ("low", "high", "reach", "horizon", "period")),
        *((name, ctypes.c_int) for name in ("rollouts", "ticks", "substeps", "next")),
    ]


def _stumpff(k: int) -> tuple[float, ...]:
    return economised([Fraction((-1) ** j, factorial(2 * j + k)) for j in range(20)], Fraction(SERIES_REACH), 8)


def _library(segments: int, width: int) -> ctypes.CDLL:
    arc = economised([Fraction((-1) ** k, 2 * k + 1) for k in range(1, 30)], _ARC_REACH, 13)
    series = {"2": E2, "3": E3, "7": _stumpff(7), "8": _stumpff(8), "_ARC": arc}
    defined = [f"-DSERIES{name}=" + ",".join(map(repr, values)) for name, values in series.items()]
    options = (f"-DSEGMENTS={segments}", f"-DLANES={width}", "-fno-math-errno", *defined)
    return compiled("bends.cpp", Path(os.environ["PEERS_CACHE"]), options)


def prepare(task: BendTask, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """One lane runs in a build one lane wide."""
    library = _library(task.segments, 1 if lanes == 1 else int(os.environ["C_LANES"]))

    def run(ticks: int) -> np.ndarray:
        arrays = {
            "plant": task.plant, "believed": task.believed, "model_y": task.model_y, "model_z": task.model_z,
            "reference": np.ascontiguousarray(task.reference[:, 0].T), "gains": np.tile(task.gains, (lanes, 1)),
            "state": np.empty((lanes, 4 * task.segments)), "sums": np.empty((lanes, SUMS)),
            "record": np.empty((ticks, 2 * task.segments)),
        }  # fmt: skip
        pointers = {name: array.ctypes.data_as(_DOUBLES) for name, array in arrays.items()}
        work = _Work(
            low=task.low, high=task.high, reach=task.reach, horizon=ticks * task.period, period=task.period,
            rollouts=lanes, ticks=ticks, substeps=steps, **pointers,
        )  # fmt: skip
        library.run(ctypes.byref(work), threads)
        return arrays["record"].ravel()

    return run
