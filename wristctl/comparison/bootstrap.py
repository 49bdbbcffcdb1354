"""Geometric means of positive scores over worlds, and ratios of two of them on the same worlds, with intervals.

A world is what was drawn as a whole: where several scores share a draw (targets, noise streams of one wrist), their
geometric mean is that world's score, since worlds are resampled as if each were drawn by itself.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.seeds import Entropy

LEVEL = 0.95
# Worlds below which no interval is given: it would hold the truth too seldom, whatever its level.
FEWEST_WORLDS = 8
_RESAMPLES, _AT_ONCE = 9999, 500
# RMSE [rad] that a failure counts as in means.
FAILURE = float(np.deg2rad(90.0))
# RMSE [rad] below which errors are equal: no rig measures less, and a simulation has its own rounding there.
MEASURABLE = float(np.deg2rad(0.001))
_GRID = 2.0**-40


class GeometricMean(NamedTuple):
    """A geometric mean, or a ratio of two, with the interval that holds it at this level; 0 to inf: not known."""

    value: float
    low: float
    high: float
    level: float

    @property
    def is_one(self) -> bool:
        """Whether it may be 1: of a ratio, that neither is better."""
        return self.low <= 1.0 <= self.high


def plain(ratio: float) -> str:
    """A ratio to three digits, never as a power of ten: 0.347, 8.51, 8676."""
    return f"{ratio:.3g}" if ratio < 1000.0 else f"{ratio:.0f}"


def penalised(scores: ArrayLike, failure: float = FAILURE, floor: float = MEASURABLE) -> Array:
    """Scores of any shape: a failure (inf or nan) counts as `failure`, nothing as worse, and nothing below `floor`.

    What a failure counts as does not depend on the other rows, so that means, ratios and orders agree with each other
    and stay when a row joins: the penalised average of algorithm configuration (Hutter et al., J. Artif. Intell. Res.
    36 (2009) 267). ValueError for a score that is not positive.
    """
    score_array = np.asarray(scores, float)
    if not failure > 0.0 or np.any(score_array <= 0.0):
        raise ValueError("geometric means are of positive scores")
    return np.maximum(np.where(score_array < failure, score_array, failure), floor)


def on_grid(logarithms: Array) -> Array:
    """Logarithms as multiples of 2^-40: what differs by rounding alone is the same, and sums have no order."""
    return np.asarray(_GRID * np.round(np.atleast_2d(logarithms) / _GRID))


class Resampled:
    """Means of rows of logarithms (m, W) over W worlds, resampled together.

    Intervals are BCa (Efron, J. Am. Stat. Assoc. 82 (1987) 171), at a level widened as Hesterberg has it for the few
    that were drawn (Am. Stat. 69 (2015) 371): with 12 worlds they hold 94 % of normal means instead of 91 %.
    """

    def __init__(self, logarithms: Array, seed: int | Entropy) -> None:
        self._rows = on_grid(logarithms)
        self.means: Array = self._rows.mean(axis=1)
        self._varied = np.ptp(self._rows, axis=1) > 0.0
        self._enough = self._rows.shape[1] >= FEWEST_WORLDS
        self._seed = seed

    def intervals(self, level: float = LEVEL) -> Array:
        """Ends of the means' intervals, (2, m); without end for fewer worlds than FEWEST_WORLDS."""
        if not self._enough:
            return np.stack([np.full(len(self.means), -np.inf), np.full(len(self.means), np.inf)])
        interval = np.stack([self.means, self.means])
        if self._varied.any():
            from scipy.stats import bootstrap

            resampled: Any = bootstrap(
                (self._rows[self._varied],), np.mean, axis=-1, batch=_AT_ONCE, method="BCa", n_resamples=_RESAMPLES,
                confidence_level=_widened(level, self._rows.shape[1]), rng=np.random.default_rng(self._seed),
            )  # fmt: skip
            interval[:, self._varied] = np.stack(resampled.confidence_interval)
        return interval

    def estimates(self, level: float = LEVEL) -> list[GeometricMean]:
        """Geometric mean of each row with its interval."""
        ends = zip(np.exp(self.means), *np.exp(self.intervals(level)), strict=True)
        return [GeometricMean(float(value), float(low), float(high), level) for value, low, high in ends]


def _widened(level: float, n: int) -> float:
    """A level whose normal quantile is the t quantile of this level for the n - 1 divisor."""
    from scipy.special import ndtr, stdtrit

    return float(1.0 - 2.0 * ndtr(-np.sqrt(n / (n - 1)) * stdtrit(n - 1, 0.5 + 0.5 * level)))


def geometric_mean(scores: ArrayLike, seed: int | Entropy, level: float = LEVEL) -> GeometricMean:
    """Geometric mean of positive scores (W,) over worlds, with its interval."""
    return Resampled(np.log(np.asarray(scores, float)), seed).estimates(level)[0]


def paired_ratio(
    scores: ArrayLike, other_scores: ArrayLike, seed: int | Entropy, level: float = LEVEL
) -> GeometricMean:
    """Geometric mean of positive scores (W,) over that of others in the same worlds."""
    return Resampled(np.log(np.asarray(scores, float)) - np.log(np.asarray(other_scores, float)), seed).estimates(
        level
    )[0]
