"""What a term of a law buys: the same worlds with and without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wristctl.comparison.geometric_means import GeometricMean, paired_ratio, penalised
from wristctl.comparison.world_ranking import FAILURE, WorldRanking

_STREAM = 20_032


class TermValue(NamedTuple):
    """How many times less a row's error is than that of the row without the term, on a family's worlds."""

    term: str
    family: str
    without: str
    given: str
    times: GeometricMean
    swings: tuple[int, int]
    """In how many worlds each of the two fails or swings."""

    @property
    def told(self) -> str:
        """In words: 1.9 times less error; nothing that could be told; more error."""
        times = self.times
        interval = f"[{times.low:.3g}, {times.high:.3g}]"
        if times.is_one:
            return f"nothing that could be told ({times.value:.3g} {interval})"
        if times.value > 1.0:
            return f"{times.value:.3g} times less error {interval}"
        return f"{1.0 / times.value:.3g} times more error [{1.0 / times.high:.3g}, {1.0 / times.low:.3g}]"


def term_values(found: WorldRanking, terms: Mapping[str, tuple[str, str]]) -> list[TermValue]:
    """Of the terms, by the labels of the rows without and with each, those of which the ranking has both."""
    places = {row.label: at for at, row in enumerate(found.rows)}
    values = []
    for term, (without, given) in terms.items():
        if without in places and given in places:
            pair = places[without], places[given]
            scores, others = (penalised(found.rows[at].rmse, FAILURE) for at in pair)
            times = paired_ratio(scores, others, _STREAM)
            values.append(
                TermValue(term, found.name, without, given, times, (_lost(found, pair[0]), _lost(found, pair[1])))
            )
    return values


def _lost(found: WorldRanking, at: int) -> int:
    """Worlds in which a row fails or swings."""
    row = found.rows[at]
    return int(np.sum(~np.isfinite(row.rmse) | row.swings))
