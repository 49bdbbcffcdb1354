"""Values that several tests share: which dataclasses could be overwritten, and references with their goals."""

from __future__ import annotations

import dataclasses
import inspect
import pkgutil
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.simulation.motion import Goals


def changeable(package: ModuleType) -> list[str]:
    """Names of the package's dataclasses whose fields could be overwritten."""
    names = [each.name for each in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
    classes = [
        each
        for name in names
        for _, each in inspect.getmembers(import_module(name), inspect.isclass)
        if each.__module__ == name and dataclasses.is_dataclass(each)
    ]
    assert classes, "a package without dataclasses needs no such test"
    return [each.__qualname__ for each in classes if not vars(each)["__dataclass_params__"].frozen]


def one_move(final: float, rest: float, horizon: float) -> Goals:
    """Goals of one move from straight to an angle [rad], which rests then [s]."""
    return Goals(final, final, 0.0, rest, horizon)


LAST_MOVES = pytest.mark.parametrize(
    ("before", "final"), [(0.6, 0.3), (-0.6, -0.3), (0.3, 0.6), (-0.3, -0.6), (0.3, -0.3), (-0.3, 0.3), (0.5, 0.0)]
)
"""Last moves [rad] that are not from straight: back and on, to both sides, over zero and to it."""


def multi_step(before: float, final: float, begin: float, horizon: float) -> tuple[Array, Goals]:
    """A reference that jumps to two angles [rad] in turn, the last one at `begin` [s], sampled every millisecond."""
    time = np.arange(round(horizon / 1e-3)) * 1e-3
    return np.where(time < begin - 1e-9, before, final), Goals(final, final - before, begin, begin, horizon)
