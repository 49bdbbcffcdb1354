"""Which unknown decides: the share of a yes or no that each explains, and where it splits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array

_BINS = 12
_RESAMPLES = 200


class Leaf(NamedTuple):
    """An unknown and the share of the variance that it explains alone."""

    name: str
    share: float


class Threshold(NamedTuple):
    """One threshold of a number, with its 95 % interval by bootstrap, and the shares of yes below and above it."""

    at: float
    low: float
    high: float
    below: float
    above: float


def deciding(yes: NDArray[np.bool_], values: Mapping[str, Sequence[Any]]) -> list[Leaf]:
    """Unknowns by the share of the variance of `yes` (N,) that each explains alone, the largest first.

    It is omega squared over bins, an estimate of the first-order Sobol index that is 0 on average where there is
    nothing to explain (Hays, Statistics (1963); Sobol', Math. Comput. Simul. 55 (2001) 271).
    """
    found = [Leaf(name, _explained(yes.astype(float), _bins(each))) for name, each in values.items()]
    return sorted(found, key=lambda leaf: -leaf.share)


def _bins(values: Sequence[Any]) -> NDArray[np.int64]:
    """Which bin each is in: of few values each its own, of many as many in each; infinity has its own."""
    if isinstance(values[0], str) or len(set(values)) <= _BINS:
        known = {value: number for number, value in enumerate(dict.fromkeys(values))}
        return np.array([known[each] for each in values])
    numbers = np.array(values, float)
    finite = np.isfinite(numbers)
    edges = np.quantile(numbers[finite], np.linspace(0.0, 1.0, _BINS + 1)[1:-1])
    return np.where(finite, np.searchsorted(edges, numbers), _BINS)


def _explained(y: Array, bins: NDArray[np.int64]) -> float:
    counts = np.bincount(bins)
    kept = counts > 0
    means = np.bincount(bins, y)[kept] / counts[kept]
    total, k = float(((y - y.mean()) ** 2).sum()), int(kept.sum())
    if total == 0.0 or k < 2 or len(y) <= k:
        return 0.0
    between = float((counts[kept] * (means - y.mean()) ** 2).sum())
    within = (total - between) / (len(y) - k)
    return max(0.0, (between - (k - 1) * within) / (total + within))


def split(yes: NDArray[np.bool_], values: Sequence[float], seed: int = 0) -> Threshold | None:
    """The one threshold of a number that leaves least variance on its sides (a tree's first split), of finite draws.

    None where all say the same.
    """
    x = np.array(values, float)
    known = np.isfinite(x)
    order = np.argsort(x[known], kind="stable")
    x, y = x[known][order], yes[known][order]
    at = _threshold(x, y)
    if at is None:
        return None
    rng = np.random.default_rng(seed)
    drawn = [np.sort(rng.integers(0, len(x), len(x))) for _ in range(_RESAMPLES)]
    again = [each for each in (_threshold(x[own], y[own]) for own in drawn) if each is not None]
    low, high = np.quantile(again, (0.025, 0.975))
    under = x < at
    return Threshold(at, float(low), float(high), float(y[under].mean()), float(y[~under].mean()))


def _threshold(x: Array, y: NDArray[np.bool_]) -> float | None:
    """Between two of the sorted values, halfway in their logarithm where they are positive."""
    before, k = np.cumsum(y)[:-1].astype(float), np.arange(1.0, len(y))
    gain = before**2 / k + (y.sum() - before) ** 2 / (len(y) - k)
    possible = x[1:] > x[:-1]
    if not possible.any() or y.all() or not y.any():
        return None
    best = int(np.where(possible, gain, -1.0).argmax())
    one, other = float(x[best]), float(x[best + 1])
    return float(np.sqrt(one * other)) if one > 0.0 else 0.5 * (one + other)
