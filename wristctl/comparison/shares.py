"""Shares of worlds: how often a law fails or swings, and how often it is how near to the best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array


class Share(NamedTuple):
    """In how many of n worlds, and the 95 % interval of the share in all worlds of such a family."""

    times: int
    n: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share."""
        return self.times / self.n


def share(happened: NDArray[np.bool_]) -> Share:
    """Of worlds (W,) in which something happened, with Wilson's interval (J. Am. Stat. Assoc. 22 (1927) 209)."""
    from scipy.stats import binomtest

    times, n = int(np.sum(happened)), len(happened)
    interval = binomtest(times, n).proportion_ci(0.95, "wilson")
    return Share(times, n, float(interval.low), float(interval.high))


def performance_profiles(scores: ArrayLike, factors: ArrayLike) -> Array:
    """Share of worlds in which each row of positive scores (R, W) is within each factor (F,) of the best, (R, F).

    A failure (inf or nan) is within none, also where all fail. (Dolan and More, Math. Program. 91 (2002) 201.)
    """
    given = np.asarray(scores, float)
    known = np.where(np.isnan(given), np.inf, given)
    best = known.min(axis=0)
    with np.errstate(invalid="ignore"):  # where all fail
        ratios = known / best
    within: Array = (ratios[:, :, None] <= np.asarray(factors, float)).mean(axis=1)
    return within
