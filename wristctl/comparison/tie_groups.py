"""Who is best, in groups that the worlds cannot tell apart, and what difference they could tell."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.comparison.geometric_means import FEWEST_WORLDS, LEVEL, GeometricMean, Resampled, penalised
from wristctl.comparison.shares import Share, share
from wristctl.seeds import Entropy

ALIKE = 1.05
"""Ratio of scores up to which rows are alike where there are too few worlds to tell."""


class TieGroup(NamedTuple):
    """Rows that may all be as good as the first of them."""

    rows: list[int]
    """From best to worst."""
    ratios: list[GeometricMean]
    """Of each row's geometric mean to the first one's, at the level at which it was judged."""


class Standing(NamedTuple):
    """Rows of scores in order."""

    groups: list[TieGroup]
    """Of rows that can be relied on, the best group first. No row is better than an earlier group's, but one may tie
    with the group's first where another, between them, does not."""
    unreliable: list[int]
    """Rows that fail or swing too often to be called best at anything, the rarest first."""
    failures: list[Share]
    """Of each row."""
    swings: list[Share]
    """Of each row."""
    floor: float
    """`resolution_floor` of the rows that can be relied on."""


def standing(
    scores: ArrayLike,
    swings: NDArray[np.bool_],
    failure: float,
    seed: int | Entropy,
    tolerated: float = 0.0,
    drawn: bool = True,
) -> Standing:
    """Order rows of positive scores (R, W) over the same worlds, less being better.

    A row fails where its score is inf or nan and is in a limit cycle where `swings` (R, W). One that does either in
    more than the `tolerated` share of the worlds is unreliable, however good its scores: it stands in no group. Where
    it is tolerated, a failure counts as the score `failure`, and nothing as worse. Worlds that are not `drawn` are all
    there are: of too few for an interval a row is then behind where the best is ahead by more than ALIKE in every one.
    """
    given = np.asarray(scores, float)
    failed = ~np.isfinite(given)
    known = np.log(penalised(given, failure))
    lost = (failed | swings).mean(axis=1)
    order = [int(row) for row in np.lexsort((known.mean(axis=1), lost))]
    sound = [row for row in np.argsort(known.mean(axis=1), kind="stable").tolist() if lost[row] <= tolerated]
    groups, rest = [], sound
    while rest:
        groups.append(_group(known, rest, seed, drawn))
        rest = [row for row in rest if row not in groups[-1].rows]
    return Standing(
        groups,
        [row for row in order if lost[row] > tolerated],
        [share(each) for each in failed],
        [share(each) for each in swings],
        resolution_floor(np.exp(known[sound]), seed),
    )


def _group(known: Array, rows: list[int], seed: int | Entropy, drawn: bool) -> TieGroup:
    """Those of rows, the best first, that may be as good as the first.

    Holm's step down (Scand. J. Stat. 6 (1979) 65): of m comparisons the clearest is judged at the level 1 - 5 %/m, the
    next at 1 - 5 %/(m - 1), to the first that may be a tie; all after it at that one's level. Then in all but 5 % of
    cases no row is left out that is as good.
    """
    best, others = rows[0], rows[1:]
    itself = GeometricMean(1.0, 1.0, 1.0, LEVEL)
    if not others:
        return TieGroup([best], [itself])
    compared = Resampled(known[others] - known[best], seed)
    if known.shape[1] < FEWEST_WORLDS and not drawn:
        others = [row for row in others if (known[row] - known[best]).min() <= np.log(ALIKE)]
        every = dict(zip(rows[1:], compared.estimates(LEVEL), strict=True))
        return TieGroup([best, *others], [itself, *(every[row] for row in others)])
    ratios: dict[int, GeometricMean] = {}
    level, tied = LEVEL, False
    for done, at in enumerate(np.argsort(-compared.evidence, kind="stable").tolist()):
        if not tied:
            level = 1.0 - (1.0 - LEVEL) / (len(others) - done)
        ratios[others[at]] = ratio = compared.estimates(level)[at]
        tied = tied or ratio.is_one
    joined = [row for row in others if ratios[row].is_one]
    return TieGroup([best, *joined], [itself, *(ratios[row] for row in joined)])


def resolution_floor(scores: ArrayLike, seed: int | Entropy) -> float:
    """The smallest ratio that these worlds can tell from 1: the half width of a pair's interval, the median of all.

    Scores are positive, (R, W); nan for fewer than two rows, inf for too few worlds.
    """
    known = np.log(np.asarray(scores, float))
    pairs = list(combinations(range(len(known)), 2))
    if not pairs:
        return float("nan")
    first, second = np.array(pairs).T
    low, high = Resampled(known[first] - known[second], seed).intervals()
    return float(np.exp(np.median(0.5 * (high - low))))
