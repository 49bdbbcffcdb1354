"""Comparisons on the same worlds: what a term of a law buys, and whether the order of laws hangs on their tuning."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import GeometricMean, Resampled, paired_ratio, penalised, plain
from wristctl.comparison.world_ranking import RankedRow, WorldRanking

_TERM_STREAM = 20_032


class TermValue(NamedTuple):
    """Ratio of the errors without and with a term of a law, on a family's worlds."""

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
        value, low, high = (_ratio(ratio) for ratio in self.times[:3])
        word = "undecided " if self.times.is_one else "worse " if self.times.value < 1.0 else ""
        lost = f", lost {self.swings[0]} -> {self.swings[1]}" if any(self.swings) else ""
        return f"{word}{value} [{low}, {high}]{lost}"


def _ratio(value: float) -> str:
    if not math.isfinite(value):
        return "any"
    return f"{value:.3f}" if 0.9 <= value <= 1.1 else plain(value)


def term_values(ranking: WorldRanking, terms: Mapping[str, tuple[str, str]]) -> list[TermValue]:
    """Value of every term whose rows without and with it are both in the ranking."""
    places, lost = {row.label: index for index, row in enumerate(ranking.rows)}, ranking.standing.lost
    values = []
    for term, (without, with_term) in terms.items():
        if without in places and with_term in places:
            pair = places[without], places[with_term]
            scores, other_scores = (penalised(ranking.rows[index].rmse) for index in pair)
            times = paired_ratio(scores, other_scores, _TERM_STREAM)
            values.append(
                TermValue(term, ranking.name, without, with_term, times, (lost[pair[0]].times, lost[pair[1]].times))
            )
    return values


_SHIFT_STREAM = 20_033


class OrderShift(NamedTuple):
    """Change in the order of the same laws under another way to tune."""

    variant: str
    tau: float
    """Kendall's rank correlation of the two orders (Biometrika 30 (1938) 81); nan for one law."""
    pairs: int
    resolved: int
    """Pairs of laws that can be told apart under both."""
    reversed: int
    """Number of those pairs that change places."""
    best: tuple[str, str]
    """Before and after."""
    ratio: float
    """Geometric mean over laws and worlds of the RMSE after over that before."""


def order_shift(variant: str, before: list[RankedRow], after: list[RankedRow]) -> OrderShift:
    """Compare rows of the same laws, in the same order, on the same worlds."""
    from scipy.stats import kendalltau

    logs_before, logs_after = (np.log([penalised(row.rmse) for row in rows]) for rows in (before, after))
    means = logs_before.mean(axis=1), logs_after.mean(axis=1)
    signs = _signs(logs_before) * _signs(logs_after)
    best = tuple(rows[int(np.argmin(mean))].label for rows, mean in zip((before, after), means, strict=True))
    tau = float(kendalltau(*means).statistic) if len(logs_before) > 1 else float("nan")
    ratio = float(np.exp(np.mean(means[1] - means[0])))
    return OrderShift(
        variant, tau, len(signs), int(np.sum(signs != 0)), int(np.sum(signs < 0)), (best[0], best[1]), ratio
    )  # fmt: skip


def _signs(logarithms: Array) -> Array:
    """Sign of the better row in every pair of rows; 0 where the worlds do not decide."""
    pairs = list(combinations(range(len(logarithms)), 2))
    if not pairs:
        return np.zeros(0)
    first, second = np.array(pairs).T
    low, high = Resampled(logarithms[first] - logarithms[second], _SHIFT_STREAM).intervals()
    return np.asarray((low > 0.0) * 1.0 - (high < 0.0) * 1.0)
