"""The same worlds twice: what a term of a law buys, and whether the order of laws hangs on their tuning."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.comparison.geometric_means import GeometricMean, Resampled, paired_ratio, penalised, plain
from wristctl.comparison.world_ranking import RankedRow, WorldRanking

_TERM_STREAM = 20_032


class TermValue(NamedTuple):
    """How many times less a row's error is than that of the row without the term, on a family's worlds."""

    term: str
    family: str
    without: str
    given: str
    times: GeometricMean
    swings: tuple[int, int]
    """In how many worlds each of the two fails, swings or chatters."""

    @property
    def told(self) -> str:
        """The ratio with its interval; undecided where that holds 1, worse below; and the worlds that are lost."""
        value, low, high = (_ratio(each) for each in self.times[:3])
        word = "undecided " if self.times.is_one else "worse " if self.times.value < 1.0 else ""
        lost = f", lost {self.swings[0]} -> {self.swings[1]}" if any(self.swings) else ""
        return f"{word}{value} [{low}, {high}]{lost}"


def _ratio(value: float) -> str:
    if not math.isfinite(value):
        return "any"
    return f"{value:.3f}" if 0.9 <= value <= 1.1 else plain(value)


def term_values(found: WorldRanking, terms: Mapping[str, tuple[str, str]]) -> list[TermValue]:
    """Of the terms, by the labels of the rows without and with each, those of which the ranking has both."""
    places, lost = {row.label: at for at, row in enumerate(found.rows)}, found.standing.lost
    values = []
    for term, (without, given) in terms.items():
        if without in places and given in places:
            pair = places[without], places[given]
            scores, others = (penalised(found.rows[at].rmse) for at in pair)
            times = paired_ratio(scores, others, _TERM_STREAM)
            values.append(
                TermValue(term, found.name, without, given, times, (lost[pair[0]].times, lost[pair[1]].times))
            )
    return values


_SHIFT_STREAM = 20_033


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
    low, high = Resampled(logarithms[first] - logarithms[second], _SHIFT_STREAM).intervals()
    return np.asarray((low > 0.0) * 1.0 - (high < 0.0) * 1.0)
