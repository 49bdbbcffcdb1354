"""Rows that may be best: the model confidence set of Hansen, Lunde and Nason (Econometrica 79 (2011) 453).

All pairs of rows are compared on the same worlds by the largest of their statistics (max-T), whose joint distribution
comes of flips of the signs of whole worlds. So the rate at which an equally good row is left out does not grow with
the number of rows, however rows are correlated.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import LEVEL, on_grid
from wristctl.seeds import Entropy

# Worlds or motions below which no outcome tells two rows apart: 2 of 2^5 flips are 6 %, and 2 of 2^6 are 3 %.
LEAST_PAIRS = 6
_FLIPS, _AT_ONCE = 4999, 500
_MOST_SKEWED = 2.0
# Worlds up to which all flips are tried, half of which mirror the other half.
_EVERY_FLIP = 13


class PairedComparisons:
    """Every pair of rows of logarithms (R, W), less being better, on the same worlds.

    The statistic of a pair is Hall's transform (J. R. Stat. Soc. B 54 (1992) 221) of its mean difference over its
    standard error, which takes out what skewness does to Student's t. It changes sign with the differences, so that
    the flips are exact where differences are symmetric.
    """

    def __init__(self, logarithms: Array, seed: int | Entropy) -> None:
        gridded = on_grid(logarithms)
        self.means: Array = gridded.mean(axis=1)
        self._pairs = np.array(list(combinations(range(len(gridded)), 2)), int).reshape(-1, 2)
        self._differences: Array = gridded[self._pairs[:, 0]] - gridded[self._pairs[:, 1]]
        self._statistics = _flipped(self._differences, seed)
        """Statistic of every pair and sign flip, (P, F); the first flip leaves all signs as they are."""
        self._level = (1.0 - LEVEL) * (1.0 - 2.0 / gridded.shape[1])
        """Share of the flips; less than 5 % for few worlds, of which the rare bad ones may all be missing."""

    def best(self, rows: Sequence[int]) -> list[int]:
        """Rows that may be best, the best first: with 95 % all that are as good as the best of them.

        While the largest statistic among those left is larger than in all but `_level` of the flips, its worse row
        goes.
        """
        left = sorted(rows, key=lambda row: (self.means[row], row))
        while len(left) > 1:
            among = np.flatnonzero(np.isin(self._pairs, left).all(axis=1))
            largest = self._largest(among)
            if np.mean(largest >= largest[0] * (1.0 - 1e-9)) > self._level or largest[0] == 0.0:
                break
            left.remove(max(self._pairs[among[np.argmax(self._statistics[among, 0])]], key=left.index))
        return left

    def _largest(self, pairs: NDArray[np.int64]) -> Array:
        """Largest statistic of these pairs under every flip, (F,); a pair at a time, since all are many megabytes."""
        largest = np.zeros(self._statistics.shape[1])
        for pair in pairs:
            np.maximum(largest, self._statistics[pair], out=largest)
        return largest

    def resolution(self, rows: Sequence[int]) -> float:
        """The smallest ratio that these worlds tell from 1 as a rule, among so many rows.

        That of a pair is where its statistic passes nearly all of the flips' largest; the median over all pairs. nan
        for fewer than two rows, inf for too few worlds.
        """
        among = np.flatnonzero(np.isin(self._pairs, list(rows)).all(axis=1))
        if not len(among):
            return float("nan")
        if self._differences.shape[1] < LEAST_PAIRS:
            return float("inf")
        needed = np.quantile(self._largest(among), 1.0 - self._level)
        return float(np.exp(needed * np.median(self._differences[among].std(axis=1, ddof=1))))


def _flipped(differences: Array, seed: int | Entropy) -> Array:
    """Size of each pair's statistic, in standard deviations of its differences (P, W), under every flip, (P, F)."""
    signs = _signs(differences.shape[1], seed)
    statistics = np.empty((len(differences), len(signs)))
    squares, cubes = (differences**2).mean(axis=1), differences**3
    for first in range(0, len(signs), _AT_ONCE):
        some = signs[first : first + _AT_ONCE]
        n = some.shape[1]
        of_flips = _transformed(some @ differences.T / n, squares, some @ cubes.T / n, n)
        statistics[:, first : first + _AT_ONCE] = of_flips.T
    return statistics


def _transformed(first: Array, second: Array, third: Array, n: int) -> Array:
    """Size of Hall's transform of mean over deviation, by the first three moments about 0 of n differences.

    Few differences show less skewness than there is (that of 8 exponential ones is half of it), hence the factor. It
    counts up to that of exponential differences: beyond it the series says nothing, and one rare failure would hide any
    difference. Neither changes a rate where differences are symmetric.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.maximum(second - first * first, 1e-12 * second)
        deviation = np.sqrt(variance)
        t = first / (deviation * np.sqrt(n / max(n - 1, 1)))
        skewness = (third - first * (3.0 * second - 2.0 * first * first)) / (variance * deviation)
        skewness = np.clip((1.0 + 6.0 / n) * skewness, -_MOST_SKEWED, _MOST_SKEWED)
        bent = skewness * t / 3.0
        statistics = np.abs(t * (1.0 + bent * (1.0 + bent / 3.0)) + skewness / (6.0 * n))
    return np.where(second > 0.0, statistics, 0.0)


@lru_cache(maxsize=4)
def _signs(worlds: int, seed: int | Entropy) -> Array:
    """Signs of each world, (F, W): every flip of few worlds, some of many; all +1 first, and the first world's +1."""
    if worlds <= _EVERY_FLIP:
        every = np.arange(2 ** (worlds - 1))[:, None] >> np.arange(worlds - 1) & 1
        return np.column_stack([np.ones(len(every)), 1.0 - 2.0 * every])
    drawn = 1.0 - 2.0 * np.random.default_rng(seed).integers(0, 2, (_FLIPS + 1, worlds))
    drawn[0] = 1.0
    return np.asarray(drawn)
