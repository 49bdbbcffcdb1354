"""Rows ranked over worlds where some were tuned several times: what an error is for whoever tunes once more.

The gains of a row are those of its median tuning: its errors in every world, and whether it fails or swings, are
theirs. Its mean error, its order and what it is worth beside another are over all of its tunings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import chain, combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import GeometricMean, Resampled, penalised, plain
from wristctl.comparison.controller_ranking import STREAM
from wristctl.comparison.repeated_tunings import HALVES, Firsts, RepeatedTunings, firsts, median_tuning
from wristctl.comparison.tie_groups import Share, share
from wristctl.comparison.world_ranking import RankedRow, WorldRanking, ranking
from wristctl.config.families import TOLERATED, Family

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class TunedRanking(WorldRanking):
    """A ranking of rows of which each has one tuning or several; `rows` are those of the published gains."""

    tunings: list[list[RankedRow]]
    """Every tuning of each row."""
    published: list[int]
    """The tuning of each row whose gains are published."""
    logarithms: Array
    """Logarithms of the errors [rad], (R, T, W, S) with S streams of noise in each world."""

    @cached_property
    def repeated(self) -> RepeatedTunings:
        """Errors of all rows over tunings, worlds and noise."""
        return RepeatedTunings(self.logarithms, STREAM)

    @property
    def more(self) -> str:
        """What would tell rows apart that these worlds and tunings do not, in words."""
        return "more worlds and tunings" if self.logarithms.shape[1] > 1 else super().more

    @cached_property
    def means(self) -> list[GeometricMean]:
        """Geometric mean of each row's RMSE [rad] over its tunings; a failure counts as 90 deg."""
        return self.repeated.estimates()

    def times_better(self, row: int, reference_row: int) -> GeometricMean:
        """Ratio of a reference row's RMSE to another row's, tunings and worlds drawn anew."""
        return self.repeated.ratio(reference_row, row)

    @cached_property
    def firsts(self) -> dict[int, Firsts]:
        """In how many halves of the worlds, and with how many tunings, each ranked row has the least error."""
        return firsts(self.logarithms, [*chain.from_iterable(self.standing.groups)], STREAM)

    def firsts_frame(self) -> pd.DataFrame:
        """A line for each ranked row: in how many halves of the worlds, and with how many tunings, it is first.

        Empty where fewer than two rows are ranked: nothing could come before the one.
        """
        import pandas as pd

        lines = [
            {"family": self.name, "row": self.labels[row], "first_in_halves": halves, "halves": HALVES,
             "first_in_tunings": tunings, "tunings": of_tunings}
            for row, (halves, tunings, of_tunings) in (self.firsts if self.may_change else {}).items()
        ]  # fmt: skip
        return pd.DataFrame(lines)

    @property
    def may_change(self) -> bool:
        """Whether two rows or more are ranked, so that another could come first."""
        return sum(map(len, self.standing.groups)) > 1

    @cached_property
    def spreads(self) -> list[tuple[float, float]]:
        """Least and largest geometric mean of the RMSE [rad] of each row's tunings."""
        means = np.exp(self.logarithms.mean(axis=(2, 3)))
        return [(float(errors.min()), float(errors.max())) for errors in means]

    def published_error(self, row: int) -> float:
        """Geometric mean of the RMSE [rad] of a row's published gains, as a comparison of them has it to the last bit.

        A failure counts as 90 deg.
        """
        return float(np.exp(Resampled(np.log(penalised(self.scores[row])), STREAM).means[0]))

    @cached_property
    def lost_of_tunings(self) -> list[list[Share]]:
        """In how many worlds each tuning of each row fails, swings, chatters or does not converge."""
        return [[share(~np.isfinite(one.rmse) | one.swings) for one in tunings] for tunings in self.tunings]

    def tunings_frame(self) -> pd.DataFrame:
        """A line for each tuning of each row that was tuned: its error [rad], and in how many worlds it is lost."""
        import pandas as pd

        lines = []
        for row, tunings in enumerate(self.tunings):
            means = np.exp(self.logarithms[row].mean(axis=(1, 2)))
            for number, lost in enumerate(self.lost_of_tunings[row] if len(tunings) > 1 else []):
                lines.append(
                    {"row": self.labels[row], "tuning": number + 1, "published": number == self.published[row],
                     "rmse": means[number], "lost": lost.times, "worlds": lost.n}
                )  # fmt: skip
        return pd.DataFrame(lines)


def tuned_ranking(
    name: str,
    family: Family,
    tunings: Sequence[Sequence[RankedRow]],
    published: Sequence[int],
    tolerated: float = TOLERATED,
    steps: bool | None = None,
) -> TunedRanking:
    """The ranking of rows, each with one tuning or as many as the others, measured on the same worlds and noise.

    The other parameters are those of `wristctl.comparison.world_ranking.ranking`.
    """
    errors = logarithms(tunings)
    rows = [of_row[number] for of_row, number in zip(tunings, published, strict=True)]
    base = ranking(name, family, rows, tolerated, steps, RepeatedTunings(errors, STREAM))
    values = {field.name: getattr(base, field.name) for field in fields(base)}
    return TunedRanking(
        **values, tunings=[list(of_row) for of_row in tunings], published=list(published), logarithms=errors
    )


def logarithms(tunings: Sequence[Sequence[RankedRow]]) -> Array:
    """Logarithms of the errors (R, T, W, S) of rows with one tuning or as many as the others."""
    most = max(map(len, tunings))
    errors = [[np.log(penalised(_streams(row))) for row in of_row] for of_row in tunings]
    return np.array([of_row * (most // len(of_row)) for of_row in errors])


def _streams(row: RankedRow) -> Array:
    """Geometric mean over the motions of a row's RMSE (W, S) in every world and stream of noise; inf: one failed."""
    rmse = np.where(row.measured.failed, np.inf, row.measured.metrics["rmse"])
    means: Array = np.exp(np.log(rmse.reshape(len(row.rmse), row.motions, -1)).mean(axis=1))
    return means


def published_tuning(tunings: Sequence[RankedRow]) -> int:
    """The median tuning of a row by its geometric mean error: whose gains are neither lucky nor unlucky."""
    return median_tuning([float(np.log(penalised(row.rmse)).mean()) for row in tunings])


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
