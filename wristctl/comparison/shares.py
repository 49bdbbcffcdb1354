"""Shares of worlds: how often a law fails, swings or chatters, and how often it is how near to the best."""

from __future__ import annotations

import math
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
        """The share; nan of none."""
        return self.times / self.n if self.n else math.nan


def share(happened: NDArray[np.bool_]) -> Share:
    """Of worlds (W,) in which something happened, with the interval of Clopper and Pearson (Biometrika 26 (1934) 404).

    It holds the true share in 95 % of cases or more, whatever that share: what lies outside of it is shown.
    """
    from scipy.special import betaincinv

    times, n = int(np.sum(happened)), len(happened)
    if n == 0:
        return Share(0, 0, math.nan, math.nan)
    low = float(betaincinv(times, n - times + 1, 0.025)) if times else 0.0
    high = float(betaincinv(times + 1, n - times, 0.975)) if times < n else 1.0
    return Share(times, n, low, high)


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
