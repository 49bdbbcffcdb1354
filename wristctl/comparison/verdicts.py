"""What a number of ours says about one of the paper's: the rules, which know neither loops nor laws.

All are two-sided and on a log scale. What fails or never settles is nan, worse than any number, and no part of a range.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.comparison.paper import FACTOR
from wristctl.config.audit import SenseName, VerdictName

SPREAD = 4.0
"""Where ours differ by as much from one motion to another, the motion decides, and the paper does not give it."""
TIE = 1.05
"""Ratio below which two numbers stand in no order."""
_OPEN: Final = "not specified enough"


class Finding(NamedTuple):
    """A verdict with the range of our finite values (nan: none), why, and what else must be known of them."""

    verdict: VerdictName
    low: float = np.nan
    high: float = np.nan
    reason: str = ""
    mark: str = ""
    """What stands beside the verdict, as `not physical`."""


def of_numbers(paper: float, ours: ArrayLike, sense: SenseName = "about") -> Finding:
    """Our values, one for each stated motion, beside the paper's; of all of them less is better."""
    values = np.asarray(ours, float)
    known = values[np.isfinite(values)]
    if not len(known):
        return Finding("worse than the paper", reason="fails or never settles")
    low, high = float(known.min()), float(known.max())
    if sense != "about":
        return _bounded(paper, values, sense)._replace(low=low, high=high)
    if low > FACTOR * paper:
        return Finding("worse than the paper", low, high)
    if len(known) < len(values):
        return Finding(_OPEN, low, high, "on one motion it fails or never settles, on another not")
    if high < paper / FACTOR:
        return Finding("better than the paper", low, high)
    if high >= SPREAD * low:
        return Finding(_OPEN, low, high, "the motion decides, and the paper does not give it")
    return Finding("reproduced", low, high)


def _bounded(paper: float, values: Array, sense: SenseName) -> Finding:
    kept = {
        "at most": values <= paper,
        "at least": values >= paper,
        "exactly": values == paper,
    }[sense]
    if kept.all():
        return Finding("reproduced")
    return Finding(_OPEN, reason="holds on some motions only") if kept.any() else Finding("worse than the paper")


def of_settling(paper: float, after: ArrayLike, motions: ArrayLike) -> Finding:
    """Settling times counted from the end of motions of these durations [s]; 0 is a step.

    The paper's time counts from the beginning of a motion that it does not give. After a step both are the same time.
    After another motion only what takes longer than the paper's whole time can be told from it.
    """
    moving = np.asarray(motions) > 0.0
    if not moving.any():
        return of_numbers(paper, after)
    values = np.asarray(after, float)
    known = values[np.isfinite(values)]
    if not len(known):
        return Finding("worse than the paper", reason="fails or never settles")
    low, high = float(known.min()), float(known.max())
    if low > FACTOR * paper:
        return Finding("worse than the paper", low, high, "from the end of the motion alone")
    return Finding(_OPEN, low, high, "counted from the end of the motion; how long the paper's lasts is not given")


def of_ordering(less: ArrayLike, more: ArrayLike) -> Finding:
    """Whether the one is less than the other on every stated motion; low and high are the ratios more / less."""
    ratios = [_ratio(a, b) for a, b in zip(np.asarray(less).tolist(), np.asarray(more).tolist(), strict=True)]
    known = [each for each in ratios if np.isfinite(each) and each > 0.0]
    ends = (min(known), max(known)) if known else (np.nan, np.nan)
    if all(each > TIE for each in ratios):
        return Finding("reproduced", *ends)
    if all(each < 1.0 / TIE for each in ratios):
        return Finding("worse than the paper", *ends, "the other way round")
    tied = all(1.0 / TIE <= each <= TIE for each in ratios)
    return Finding(_OPEN, *ends, "alike within 5 %" if tied else "the motion decides, and the paper does not give it")


def _ratio(less: float, more: float) -> float:
    """more / less; what failed is beyond any number, and two that failed are alike."""
    a, b = np.isfinite(less), np.isfinite(more)
    if a and b:
        return 1.0 if less == more else more / less if less > 0.0 else np.inf
    return 1.0 if a == b else np.inf if a else 0.0


def of_sample(paper: float, middle: float, ends: tuple[float, float] | None, sense: SenseName = "about") -> Finding:
    """A median over seeds with its interval beside the paper's value; where the interval is too wide it stays open."""
    if not np.isfinite(middle):
        return Finding("worse than the paper", reason="there is no such number")
    low, high = ends or (middle, middle)
    if sense == "about":
        return _about(paper, low, high)
    kept: Callable[[float], bool] = {
        "at most": lambda each: each <= paper,
        "at least": lambda each: each >= paper,
        "exactly": lambda each: low <= paper <= high,
    }[sense]
    if kept(low) == kept(high):
        return Finding("reproduced" if kept(low) else "worse than the paper", low, high)
    return Finding("open", low, high, "more seeds would decide")


def _about(paper: float, low: float, high: float) -> Finding:
    if low > FACTOR * paper:
        return Finding("worse than the paper", low, high)
    if high < paper / FACTOR:
        return Finding("better than the paper", low, high)
    if low <= 0.0 or high >= SPREAD * low:
        return Finding("open", low, high, "the interval is too wide: more seeds would decide")
    return Finding("reproduced", low, high)
