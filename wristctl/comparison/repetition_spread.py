"""Statistics of a number over several repetitions."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.95


class Spread(NamedTuple):
    """The median of n repetitions with its confidence interval; nan is `never`, also as the end of an interval."""

    median: float
    low: float
    high: float
    n: int

    @property
    def interval(self) -> tuple[float, float] | None:
        """None where there are too few repetitions for one."""
        return None if self.n < FEWEST else (self.low, self.high)


# Repetitions below which no interval holds the median with 95 %: half of them lie on one side of it all too often.
FEWEST = 6


def spread(values: NDArray[np.float64]) -> Spread:
    """Median of values (n,) and its 95 % interval by order statistics, which asks nothing of their distribution.

    A repetition that diverged or never got there (nan) counts as the largest value: it is kept. (Conover, Practical
    Nonparametric Statistics (1999), section 3.2; SciPy's quantile_test.)
    """
    ordered = np.sort(np.where(np.isnan(values), np.inf, values))
    n = len(ordered)
    with np.errstate(invalid="ignore"):
        median = float(0.5 * (ordered[(n - 1) // 2] + ordered[n // 2]))
    if n < FEWEST:
        return Spread(_never(median), np.nan, np.nan, n)
    from scipy.stats import quantile_test

    interval: Any = quantile_test(ordered, q=0.0, p=0.5).confidence_interval(LEVEL)
    return Spread(_never(median), _never(float(interval.low)), _never(float(interval.high)), n)


def spread_over_time(courses: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """`spread` of courses (n, T) sample by sample: median, low and high, (T,) each; inf where they are no numbers."""
    ordered = np.sort(np.where(np.isnan(courses), np.inf, courses), axis=0)
    n = len(ordered)
    ranks = spread(np.arange(n, dtype=np.float64))
    with np.errstate(invalid="ignore"):
        median = 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2])
    if ranks.interval is None:
        return median, np.full_like(median, np.nan), np.full_like(median, np.nan)
    low, high = (ordered[int(rank)] for rank in ranks.interval)
    return median, low, high


def _never(value: float) -> float:
    return value if np.isfinite(value) else float("nan")
