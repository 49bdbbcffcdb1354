"""Verdicts on the paper's numbers from ours: the rules, which know neither loops nor laws.

All are two-sided and on a log scale. What fails or never settles is nan, worse than any number, and no part of a range.
A printed number stands for all that its digits may have been rounded from: no verdict turns on them.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.comparison.paper import FACTOR, Ends
from wristctl.config.audit import SenseName, VerdictName

# Ratio between motions beyond which ours are open: the motion decides, and the paper does not give it.
SPREAD = 4.0
# Ratio below which two numbers stand in no order.
TIE = 1.05
_OPEN: Final = "not specified enough"
_NEVER = "fails or never settles"


class Finding(NamedTuple):
    """A verdict with the range of our finite values (nan: none), why, and what else must be known of them."""

    verdict: VerdictName
    low: float = np.nan
    high: float = np.nan
    reason: str = ""
    mark: str = ""
    """Marks beside the verdict, as `not physical` or `not converged`."""
    beside: VerdictName | None = None
    """Verdict under our choice of a detail that the paper leaves open."""


# Verdicts of what fails, the gravest first.
FAILING: tuple[VerdictName, ...] = ("contradicted", "does not hold", "worse than the paper")


def joint(verdicts: Iterable[VerdictName]) -> VerdictName | None:
    """The one verdict of all: what fails everywhere is one, by its gravest word; else what is not given decides.

    What is open leaves that open, unless the others differ already. None of nothing.
    """
    different = set(verdicts)
    if len(different) <= 1:
        return next(iter(different), None)
    if "open" in different:
        decided = joint(different - {"open"})
        return decided if decided == _OPEN else "open"
    if different <= set(FAILING):
        return next(verdict for verdict in FAILING if verdict in different)
    return _OPEN


def of_numbers(paper: float | Ends, ours: ArrayLike, sense: SenseName = "about") -> Finding:
    """Our values, one for each stated motion, beside the paper's; of all of them less is better."""
    values, printed = np.asarray(ours, float), _ends(paper)
    if not np.isfinite(values).any():
        return Finding(_worst(sense), reason=_NEVER)
    low, high = _range(values)
    if sense != "about":
        return _bounded(printed, values, sense)._replace(low=low, high=high)
    if not np.isfinite(values).all() and low <= FACTOR * printed.high:
        return Finding(_OPEN, low, high, "on one motion it fails or never settles, on another not")
    return _about(printed, low, high, Finding(_OPEN, low, high, "the motion decides, and the paper does not give it"))


def _worst(sense: SenseName) -> VerdictName:
    return "worse than the paper" if sense == "about" else "does not hold"


def _range(values: Array) -> Ends:
    """The least and the greatest of the finite values."""
    finite = values[np.isfinite(values)]
    return Ends(float(finite.min()), float(finite.max()))


def _bounded(paper: Ends, values: Array, sense: SenseName) -> Finding:
    """A bound holds within all that its printed digits may stand for, or it fails beyond all of that."""
    kept, broken = _kept(paper, values, sense)
    if kept.all():
        return Finding("reproduced")
    if broken.all():
        return Finding("does not hold")
    mixed = kept.any() and broken.any()
    return Finding(_OPEN, reason="holds on some motions only" if mixed else "within the rounding of what is printed")


def _kept(paper: Ends, values: Array, sense: SenseName) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Values that keep, and values that break, a bound wherever it lies between its ends; nan breaks it."""
    if sense == "at most":
        return values <= paper.low, ~(values <= paper.high)
    if sense == "at least":
        return values >= paper.high, ~(values >= paper.low)
    return values == paper.low, ~((values >= paper.low) & (values <= paper.high))


def _ends(paper: float | Ends) -> Ends:
    return paper if isinstance(paper, Ends) else Ends(paper, paper)


def of_settling(paper: float | Ends, after: ArrayLike, motions: ArrayLike) -> Finding:
    """Settling times counted from the end of motions of these durations [s]; 0 is a step.

    The paper's time counts from the beginning of a motion that it does not give. After a step both are the same time.
    After another motion only what takes longer than the paper's whole time can be told from it.
    """
    moving = np.asarray(motions) > 0.0
    if not moving.any():
        return of_numbers(paper, after)
    values = np.asarray(after, float)
    if not np.isfinite(values).any():
        return Finding("worse than the paper", reason=_NEVER)
    low, high = _range(values)
    if low > FACTOR * _ends(paper).high:
        return Finding("worse than the paper", low, high, "from the end of the motion alone")
    return Finding(_OPEN, low, high, "counted from the end of the motion; how long the paper's lasts is not given")


def of_ordering(less: ArrayLike, more: ArrayLike) -> Finding:
    """Whether the one is less than the other on every stated motion; low and high are the ratios more / less."""
    ratios = [_ratio(a, b) for a, b in zip(np.asarray(less).tolist(), np.asarray(more).tolist(), strict=True)]
    positive = [ratio for ratio in ratios if np.isfinite(ratio) and ratio > 0.0]
    ends = (min(positive), max(positive)) if positive else (np.nan, np.nan)
    if all(ratio > TIE for ratio in ratios):
        return Finding("reproduced", *ends)
    if all(ratio < 1.0 / TIE for ratio in ratios):
        return Finding("does not hold", *ends, "the other way round")
    tied = all(1.0 / TIE <= ratio <= TIE for ratio in ratios)
    return Finding(_OPEN, *ends, "alike within 5 %" if tied else "the motion decides, and the paper does not give it")


def _ratio(less: float, more: float) -> float:
    """more / less; what failed is beyond any number, and two that failed are alike."""
    a, b = np.isfinite(less), np.isfinite(more)
    if a and b:
        return 1.0 if less == more else more / less if less > 0.0 else np.inf
    return 1.0 if a == b else np.inf if a else 0.0


def of_sample(
    paper: float | Ends, middle: float, ends: tuple[float, float] | None, sense: SenseName = "about"
) -> Finding:
    """A median over seeds with its interval beside the paper's value; where the interval is too wide it stays open."""
    if not np.isfinite(middle):
        return Finding(_worst(sense), reason="there is no such number")
    low, high = ends or (middle, middle)
    printed = _ends(paper)
    if sense == "about":
        return _about(
            printed, low, high, Finding("open", low, high, "the interval is too wide: more seeds would decide")
        )
    if sense == "exactly":
        inside = low <= printed.high and high >= printed.low
        return Finding("reproduced" if inside else "does not hold", low, high)
    kept, broken = _kept(printed, np.array([low, high]), sense)
    if kept.all() or broken.all():
        return Finding("reproduced" if kept.all() else "does not hold", low, high)
    return Finding("open", low, high, "more seeds would decide")


def _about(paper: Ends, low: float, high: float, wide: Finding) -> Finding:
    if low > FACTOR * paper.high:
        return Finding("worse than the paper", low, high)
    if high < paper.low / FACTOR:
        return Finding("better than the paper", low, high)
    return wide if high >= SPREAD * low else Finding("reproduced", low, high)
