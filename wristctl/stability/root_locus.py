"""Where a loop's poles go as one of its gains changes, and within which values it is stable."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wristctl.arrays import Array
from wristctl.stability.margins import NEUTRAL
from wristctl.stability.sampled_loop import Mode, SampledLoop

_POINTS, _HALVINGS = 41, 12
At = Callable[[float], SampledLoop | None]
"""The closed loop with a gain times a factor; None where it rests nowhere near."""


@dataclass(frozen=True)
class RootLocus:
    """Poles as (growth [1/s], frequency [Hz]) rows (poles, 2) at each of the factors (G,) of the gain.

    `least` and `most` are the factors between which it is stable, about 1; 0 and inf where no limit was met within
    what was looked at, nan where it is not stable at 1. `swings` are the frequencies [Hz] at these limits.
    """

    over: str
    factors: Array
    poles: Sequence[Array]
    least: float
    most: float
    swings: tuple[float, float]


def root_locus(over: str, at: At, span: float) -> RootLocus:
    """The locus from 1/span to span times the gain, of the loop that `at` gives."""
    factors = np.geomspace(1.0 / span, span, _POINTS)
    modes = [_modes(at, float(each)) for each in factors]
    poles = [np.array([(mode.growth, mode.frequency) for mode in each]).reshape(-1, 2) for each in modes]
    stable = [bool(each) and each[0].growth < NEUTRAL for each in modes]
    middle = _POINTS // 2
    if not stable[middle]:
        return RootLocus(over, factors, poles, math.nan, math.nan, (math.nan, math.nan))
    low = next((k for k in range(middle, -1, -1) if not stable[k]), None)
    high = next((k for k in range(middle, _POINTS) if not stable[k]), None)
    least, slow = (0.0, math.nan) if low is None else _limit(at, float(factors[low + 1]), float(factors[low]))
    most, fast = (math.inf, math.nan) if high is None else _limit(at, float(factors[high - 1]), float(factors[high]))
    return RootLocus(over, factors, poles, least, most, (slow, fast))


def _modes(at: At, factor: float) -> list[Mode]:
    loop = at(factor)
    return [] if loop is None else loop.modes()


def _limit(at: At, good: float, bad: float) -> tuple[float, float]:
    """The limit between a factor with which it is stable and one with which it is not, and its swing there [Hz]."""
    for _ in range(_HALVINGS):
        middle = math.sqrt(good * bad)
        modes = _modes(at, middle)
        good, bad = (middle, bad) if modes and modes[0].growth < NEUTRAL else (good, middle)
    found = _modes(at, bad)
    return good, found[0].frequency if found else math.nan
