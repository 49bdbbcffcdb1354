"""What a term of a law buys: the same worlds with and without it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from wristctl.comparison.geometric_means import GeometricMean, paired_ratio, penalised, plain
from wristctl.comparison.world_ranking import WorldRanking

_STREAM = 20_032


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
            times = paired_ratio(scores, others, _STREAM)
            values.append(
                TermValue(term, found.name, without, given, times, (lost[pair[0]].times, lost[pair[1]].times))
            )
    return values
