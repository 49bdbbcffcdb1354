"""Who is best, in groups that the worlds cannot tell apart, who stands in none and why, and what could be told."""

import math
from collections.abc import Sequence
from itertools import chain
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import FAILURE, MEASURABLE, penalised
from wristctl.comparison.model_confidence_set import LEAST_PAIRS, PairedComparisons
from wristctl.seeds import Entropy


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
    """Share of worlds (W,) with an event, with the interval of Clopper and Pearson (Biometrika 26 (1934) 404).

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
    score_array = np.asarray(scores, float)
    scores_or_inf = np.where(np.isnan(score_array), np.inf, score_array)
    best = scores_or_inf.min(axis=0)
    with np.errstate(invalid="ignore"):  # where all fail
        ratios = scores_or_inf / best
    within: Array = (ratios[:, :, None] <= np.asarray(factors, float)).mean(axis=1)
    return within


# Outcome of a row in a ranking; every row has one.
Fate = Literal["ranked", "too few to tell", "not physical", "does not arrive", "unreliable"]


class Standing(NamedTuple):
    """Rows of scores in order; each row stands in exactly one of the five lists."""

    groups: list[list[int]]
    """Ranked rows by group, the best group first, best row first: with 95 % all that are as good as its first."""
    untold: list[int]
    """Rows that could be ranked, from best to worst, were there worlds enough to tell them apart."""
    unphysical: list[int]
    """Rows that pull harder than a tendon bears, from best to worst."""
    short: list[int]
    """Rows that stay within their range and do not arrive, from best to worst."""
    unreliable: list[int]
    """Rows that are shown to fail, swing or chatter in more than the tolerated share of worlds, the rarest first."""
    lost: list[Share]
    """Worlds in which each row fails, swings or chatters."""
    failures: list[Share]
    """Share of worlds in which a row fails, by row."""
    swings: list[Share]
    """Share of worlds, by row, in which a row does not fail but swings, chatters or has not converged."""
    floor: float
    """The smallest ratio of scores that the ranked rows are told apart by as a rule; nan for fewer than two."""

    @property
    def order(self) -> list[int]:
        """All rows: ranked from best to worst, then those that stand in no group."""
        return [*chain.from_iterable(self.groups), *self.untold, *self.unusable]

    @property
    def unusable(self) -> list[int]:
        """Rows that must not be used: they fail, swing, chatter, do not arrive or pull harder than a tendon bears."""
        return [*self.unphysical, *self.short, *self.unreliable]

    def group(self, row: int) -> int | None:
        """The number of a row's group, from 1; None where it stands in none."""
        return next((group for group, rows in enumerate(self.groups, start=1) if row in rows), None)

    def fate(self, row: int) -> Fate:
        """In which of the lists a row stands."""
        fates: dict[Fate, list[int]] = {
            "too few to tell": self.untold,
            "not physical": self.unphysical,
            "does not arrive": self.short,
            "unreliable": self.unreliable,
        }
        return next((fate for fate, rows in fates.items() if row in rows), "ranked")


class Comparisons(Protocol):
    """Rows of logarithms compared pair by pair: their means, which of them may be best, and what could be told."""

    means: Array

    def best(self, rows: Sequence[int]) -> list[int]:
        """Rows that may be best, the best first."""
        ...

    def resolution(self, rows: Sequence[int]) -> float:
        """The smallest ratio that is told from 1 as a rule."""
        ...


def standing(
    scores: ArrayLike,
    swings: NDArray[np.bool_],
    seed: int | Entropy,
    tolerated: float = 0.0,
    short: ArrayLike = False,
    unphysical: ArrayLike = False,
    failure: float = FAILURE,
    floor: float = MEASURABLE,
    compared: Comparisons | None = None,
) -> Standing:
    """Order rows of positive scores (R, W) over the same worlds, less being better.

    A row fails where its score is inf or nan, and swings, chatters or has not converged where `swings` (R, W). It is
    unreliable, however good its scores, where its share of such worlds is shown to exceed the `tolerated` one: where
    the 95 % interval of that share lies above it. Else a failure counts as the score `failure`. What is below `floor`
    is equal. Rows (R,) that are `short` or `unphysical` are not ranked either.

    Two rows or more of fewer worlds than LEAST_PAIRS are not told apart, nor called a tie. `compared` are the rows'
    comparisons; where there are none, they are compared over the worlds.
    """
    score_array = np.asarray(scores, float)
    failed = ~np.isfinite(score_array)
    logs = np.log(penalised(score_array, failure, floor))
    lost = [share(flags) for flags in failed | swings]
    comparisons = compared or PairedComparisons(logs, seed)
    means = comparisons.means
    by_mean = np.argsort(means, kind="stable").tolist()
    rarest = np.lexsort((means, np.array([interval.value for interval in lost]))).tolist()
    marks = [np.broadcast_to(each, len(lost)) for each in ([each.low > tolerated for each in lost], short, unphysical)]
    fates = np.select(marks, ["unreliable", "short", "unphysical"], "sound")
    sound, far, strained = ([row for row in by_mean if fates[row] == fate] for fate in ("sound", "short", "unphysical"))
    enough = len(sound) < 2 or score_array.shape[1] >= LEAST_PAIRS
    groups, left = [], sound if enough else []
    while left:
        groups.append(comparisons.best(left))
        left = [row for row in left if row not in groups[-1]]
    return Standing(
        groups, [] if enough else sound, strained, far,
        [row for row in rarest if fates[row] == "unreliable"],
        lost, [share(flags) for flags in failed], [share(flags) for flags in swings & ~failed],
        comparisons.resolution(sound),
    )  # fmt: skip
