"""Whether the order of laws hangs on how they were tuned: the same worlds, gains found another way."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.comparison.geometric_means import Resampled, penalised
from wristctl.comparison.world_ranking import RankedRow

_STREAM = 20_033


class OrderShift(NamedTuple):
    """What another way to tune does to the order of the same laws."""

    variant: str
    tau: float
    """Kendall's rank correlation of the two orders (Biometrika 30 (1938) 81); nan for one law."""
    pairs: int
    resolved: int
    """Pairs of laws that can be told apart under both."""
    reversed: int
    """Of these, pairs that change places."""
    best: tuple[str, str]
    """Before and after."""
    ratio: float
    """Geometric mean over laws and worlds of the RMSE after over that before."""


def order_shift(variant: str, before: list[RankedRow], after: list[RankedRow]) -> OrderShift:
    """Compare rows of the same laws, in the same order, on the same worlds."""
    from scipy.stats import kendalltau

    known, other = (np.log([penalised(row.rmse) for row in rows]) for rows in (before, after))
    means = known.mean(axis=1), other.mean(axis=1)
    signs = _signs(known) * _signs(other)
    best = tuple(rows[int(np.argmin(each))].label for rows, each in zip((before, after), means, strict=True))
    tau = float(kendalltau(*means).statistic) if len(known) > 1 else float("nan")
    ratio = float(np.exp(np.mean(means[1] - means[0])))
    return OrderShift(
        variant, tau, len(signs), int(np.sum(signs != 0)), int(np.sum(signs < 0)), (best[0], best[1]), ratio
    )  # fmt: skip


def _signs(logarithms: Array) -> Array:
    """Of each pair of rows who is better, 0 where that cannot be told."""
    pairs = list(combinations(range(len(logarithms)), 2))
    if not pairs:
        return np.zeros(0)
    first, second = np.array(pairs).T
    low, high = Resampled(logarithms[first] - logarithms[second], _STREAM).intervals()
    return np.asarray((low > 0.0) * 1.0 - (high < 0.0) * 1.0)
