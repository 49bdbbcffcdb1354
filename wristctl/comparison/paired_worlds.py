"""Comparisons on the same worlds: what a term of a law buys, and whether the order of laws hangs on their tuning."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import GeometricMean, plain
from wristctl.comparison.repeated_tunings import RepeatedTunings
from wristctl.comparison.tuned_ranking import logarithms
from wristctl.comparison.world_ranking import RankedRow, WorldRanking


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
            times = ranking.times_better(pair[1], pair[0])
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


def order_shift(
    variant: str, before: Sequence[Sequence[RankedRow]], after: Sequence[Sequence[RankedRow]]
) -> OrderShift:
    """Compare rows of the same laws, in the same order, on the same worlds, each with its tunings before and after."""
    from scipy.stats import kendalltau

    errors = logarithms(before), logarithms(after)
    means = [of_side.mean(axis=(1, 2, 3)) for of_side in errors]
    signs = _signs(errors[0]) * _signs(errors[1])
    best = tuple(rows[int(np.argmin(mean))][0].label for rows, mean in zip((before, after), means, strict=True))
    tau = float(kendalltau(*means).statistic) if len(before) > 1 else float("nan")
    ratio = float(np.exp(np.mean(means[1] - means[0])))
    return OrderShift(
        variant, tau, len(signs), int(np.sum(signs != 0)), int(np.sum(signs < 0)), (best[0], best[1]), ratio
    )  # fmt: skip


def _signs(errors: Array) -> Array:
    """Sign of the better row in every pair of rows (R, T, W, S); 0 where tunings and worlds do not decide."""
    repeated = RepeatedTunings(errors, _SHIFT_STREAM)
    ratios = [repeated.ratio(*pair) for pair in combinations(range(len(errors)), 2)]
    return np.array([float(ratio.low > 1.0) - float(ratio.high < 1.0) for ratio in ratios])
