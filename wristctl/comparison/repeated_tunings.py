"""Controllers that were tuned several times, on the same worlds with the same noise: how sure an error, a ratio and an
order are for whoever tunes once more.

A tuning, a world and a stream of noise are all drawn: errors are resampled over each of them. Tunings and worlds are
crossed, since every tuning is tested on every world, and streams are nested in worlds (pigeonhole bootstrap: Owen, Ann.
Appl. Stat. 1 (2007) 386; nested levels: Davison and Hinkley, Bootstrap Methods, 1997, section 3.8).
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import LEVEL, GeometricMean
from wristctl.seeds import Entropy

# Tunings below which no interval is given: of two, Student's t allows a factor of a million.
FEWEST_TUNINGS = 3
_RESAMPLES, _AT_ONCE = 3999, 250
# Halves of the worlds in which the order is looked at.
HALVES = 50


class _Resamples(NamedTuple):
    """Shares of tunings (B, T) and of streams in worlds (B, W * S), and factors (B,) on what either does to a mean."""

    tunings: Array
    streams: Array
    tuning_factor: Array
    world_factor: Array


class RepeatedTunings:
    """Means of R rows of logarithms over T tunings, W worlds and S streams of noise in each, resampled together.

    A tuning of one row is drawn with the tuning of the same number of another, which is searched on the same worlds.
    What few tunings do to a mean is spread as Student's t with T - 1 degrees of freedom, and likewise with worlds:
    resamples of 5 tunings alone are too narrow by a third. Two tunings of a row tell no interval: it is then without
    end. With a single one all that is said is of those gains.

    Parameters
    ----------
    logarithms
        Logarithms of the errors, (R, T, W, S); a row that is not tuned has the same for every tuning.
    seed
        Seed of the resampling: the same errors give the same intervals.
    """

    def __init__(self, logarithms: Array, seed: int | Entropy) -> None:
        rows, tunings, worlds, streams = logarithms.shape
        flat = logarithms.reshape(rows, tunings, worlds * streams)
        self._told = (tunings == 1) | (tunings >= FEWEST_TUNINGS) | np.all(flat == flat[:, :1], axis=(1, 2))
        self.means: Array = flat.mean(axis=(1, 2))
        drawn = _resamples(tunings, worlds, streams, seed)
        by_worlds = (drawn.streams @ flat.reshape(rows * tunings, -1).T).reshape(-1, rows, tunings)
        of_tunings = drawn.tunings @ flat.mean(axis=2).T - self.means
        of_worlds = by_worlds.mean(axis=2) - self.means
        of_both = np.einsum("brt,bt->br", by_worlds, drawn.tunings) - self.means - of_tunings - of_worlds
        self._deviations: Array = (
            of_tunings * drawn.tuning_factor[:, None] + of_worlds * drawn.world_factor[:, None] + of_both
        )
        """Resampled means less the means, (B, R)."""

    def estimates(self, level: float = LEVEL) -> list[GeometricMean]:
        """Geometric mean of each row's errors with its interval."""
        deviations = [self._deviations[:, row] if self._told[row] else None for row in range(len(self.means))]
        return [_estimate(mean, apart, level) for mean, apart in zip(self.means, deviations, strict=True)]

    def ratio(self, row: int, other: int, level: float = LEVEL) -> GeometricMean:
        """Geometric mean of a row's errors over another's, with its interval."""
        told = self._told[row] and self._told[other]
        apart = self._deviations[:, row] - self._deviations[:, other] if told else None
        return _estimate(self.means[row] - self.means[other], apart, level)

    def best(self, rows: Sequence[int]) -> list[int]:
        """Rows that may be best, the best first: with 95 % all that are as good as the best of them.

        The model confidence set (wristctl.comparison.model_confidence_set) with differences over their own 95 % bounds.
        """
        left = sorted(rows, key=lambda row: (self.means[row], row))
        while len(left) > 1:
            pairs = np.array(list(combinations(left, 2)))
            differences = np.abs(self.means[pairs[:, 0]] - self.means[pairs[:, 1]])
            resampled, bounds = self._bounded(pairs)
            sizes = np.divide(differences, bounds, out=np.zeros_like(differences), where=bounds > 0.0)
            if sizes.max() <= np.quantile(resampled.max(axis=1), LEVEL):
                break
            left.remove(max(pairs[np.argmax(sizes)].tolist(), key=left.index))
        return left

    def resolution(self, rows: Sequence[int]) -> float:
        """The smallest ratio that is told from 1 as a rule among so many rows; nan for fewer than two, or tunings."""
        if len(rows) < 2 or not self._told[list(rows)].all():
            return float("nan")
        resampled, bounds = self._bounded(np.array(list(combinations(rows, 2))))
        return float(np.exp(np.quantile(resampled.max(axis=1), LEVEL) * np.median(bounds)))

    def _bounded(self, pairs: NDArray[np.int_]) -> tuple[Array, Array]:
        """Sizes of each pair's resampled deviations over their 95 % bound, (B, P), and the bounds, (P,)."""
        apart = np.abs(self._deviations[:, pairs[:, 0]] - self._deviations[:, pairs[:, 1]])
        bounds = np.quantile(apart, LEVEL, axis=0)
        return np.divide(apart, bounds, out=np.zeros_like(apart), where=bounds > 0.0), bounds


def _estimate(mean: float, deviations: Array | None, level: float) -> GeometricMean:
    if deviations is None:
        return GeometricMean(float(np.exp(mean)), 0.0, np.inf, level)
    low, high = np.quantile(deviations, [0.5 - 0.5 * level, 0.5 + 0.5 * level])
    return GeometricMean(float(np.exp(mean)), float(np.exp(mean + low)), float(np.exp(mean + high)), level)


@lru_cache(maxsize=4)
def _resamples(tunings: int, worlds: int, streams: int, seed: int | Entropy) -> _Resamples:
    rng = np.random.default_rng(seed)
    shares = rng.multinomial(tunings, np.full(tunings, 1.0 / tunings), _RESAMPLES) / tunings
    times = rng.multinomial(worlds, np.full(worlds, 1.0 / worlds), _RESAMPLES)
    if streams > 1:
        inner = rng.multinomial(times * streams, np.full(streams, 1.0 / streams)) / (worlds * streams)
    else:
        inner = times[..., None] / worlds
    factors = [_factor(rng, count) for count in (tunings, worlds)]
    return _Resamples(shares, inner.reshape(_RESAMPLES, -1), factors[0], factors[1])


def _factor(rng: np.random.Generator, count: int) -> Array:
    """Factors (B,) that make what a resample of so many does to a mean as wide as Student's t."""
    if count < 2:
        return np.ones(_RESAMPLES)
    return np.sqrt(count / rng.chisquare(count - 1, _RESAMPLES))


class Firsts(NamedTuple):
    """In how many halves of the worlds, and with how many of the tunings, a row has the least error of all."""

    halves: int
    tunings: int
    of_tunings: int


def firsts(logarithms: Array, rows: Sequence[int], seed: int | Entropy) -> dict[int, Firsts]:
    """How often each of some rows of logarithms (R, T, W, S) is first: in halves of the worlds, and in tunings."""
    of_rows, rng = logarithms[list(rows)].mean(axis=3), np.random.default_rng(seed)
    of_worlds, worlds = of_rows.mean(axis=1), of_rows.shape[2]
    halves = [rng.permutation(worlds)[: max(1, worlds // 2)] for _ in range(HALVES)]
    by_halves = [int(np.argmin(of_worlds[:, half].mean(axis=1))) for half in halves]
    by_tunings = np.argmin(of_rows.mean(axis=2), axis=0).tolist()
    return {
        row: Firsts(by_halves.count(place), by_tunings.count(place), len(by_tunings)) for place, row in enumerate(rows)
    }


def median_tuning(errors: Sequence[float]) -> int:
    """The tuning in the middle by its error; of an even number the worse of the two there."""
    return int(np.argsort(errors, kind="stable")[len(errors) // 2])
