"""Result of a study of all laws in words: the law for each rig, its ties, and the gain of each term."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import degrees, in_lines, percent

if TYPE_CHECKING:
    from wristctl.comparison.paired_worlds import OrderShift, TermValue
    from wristctl.comparison.world_ranking import WorldRanking

# Row of the paper's law with gains that were searched for as those of all others.
PAPERS = "smc/tuned"


def answer(
    rankings: Mapping[str, WorldRanking],
    terms: Sequence[TermValue],
    shifts: Sequence[OrderShift],
    varied: str = "",
) -> list[str]:
    """Law for each rig, gain of each term, and reliability of the order, as lines of text.

    Parameters
    ----------
    rankings
        Rankings of the rows by family.
    terms
        RMSE without each term over RMSE with it, by family.
    shifts
        Changes of the order where laws were tuned otherwise.
    varied
        Family on which the variants were tuned; left out of the text where empty.
    """
    sentences = [f"{family} ({ranking.family.about}): {_rig(ranking)}" for family, ranking in rankings.items()]
    sentences += [_legend(ranking) for ranking in list(rankings.values())[:1]]
    names = list(dict.fromkeys(value.term for value in terms))
    if names:
        sentences.append(
            "What a term buys: RMSE without it over RMSE with it, above 1 the better; undecided where the interval "
            "holds 1; lost are the worlds in which the law fails, swings or chatters, without -> with it."
        )
    sentences += [_term(name, [value for value in terms if value.term == name]) for name in names]
    sentences += [_shift(shift, varied) for shift in shifts]
    lines: list[str] = []
    for sentence in sentences:
        lines += ["", *in_lines(sentence)]
    return lines[1:]


def quietest(ranking: WorldRanking, rows: Sequence[int]) -> int:
    """Index of the row, among `rows`, with the least variation of tension."""
    import numpy as np

    return min(rows, key=lambda index: float(np.nanmedian(ranking.rows[index].measured.metrics["chattering"])))


def _rig(ranking: WorldRanking) -> str:
    from wristctl.comparison.bootstrap import plain

    groups = ranking.standing.groups
    if not groups:
        return f"{_none(ranking)}{_lost(ranking)}"
    best, yardstick = groups[0], ranking.yardstick
    first, ties = best[0], [index for index in best[1:] if index != yardstick]
    if yardstick in best:
        sentence = f"run feedforward, {_interval(ranking, yardstick)} deg: no law is told apart from it for the better."
        sentence += f" The lowest is {_named(ranking, first)}." if first != yardstick else ""
    else:
        gain = ranking.gains[first]
        times = f"{plain(gain.value)} [{plain(gain.low)}, {plain(gain.high)}]"
        sentence = (
            f"run {ranking.rows[first].label}: RMSE {_interval(ranking, first)} deg, {times} times below feedforward's"
        )
        sentence += f" {_deg(ranking.means[yardstick].value)}."
    if ties:
        sentence += f" Not told apart from it: {', '.join(_named(ranking, index) for index in ties)}."
        sentence += f" Of all these {ranking.rows[quietest(ranking, best)].label} moves the tendons least."
    if len(groups) > 1:
        sentence += f" Told apart, the nearest: {_named(ranking, groups[1][0])}."
    papers = next((index for index, row in enumerate(ranking.rows) if row.label == PAPERS and index not in best), None)
    if papers is not None:
        ratio = ranking.means[papers].value / ranking.means[first].value
        sentence += f" The paper's law, tuned: {_deg(ranking.means[papers].value)}, {plain(ratio)} times the lowest."
    return f"{sentence}{_floor(ranking)}{_seldom(ranking)}{_lost(ranking)}"


def _none(ranking: WorldRanking) -> str:
    """Reason why no row is recommended."""
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    if not ranking.standing.untold:
        return "run none of these."
    names = ", ".join(_named(ranking, index) for index in ranking.standing.untold)
    return f"{ranking.worlds} worlds are too few to tell apart {names}: {LEAST_PAIRS} or more."


def _floor(ranking: WorldRanking) -> str:
    floor = ranking.standing.floor
    finite = math.isfinite(floor)
    return f" As a rule differences of {100.0 * (floor - 1.0):.2g} % or more are told apart." if finite else ""


def _seldom(ranking: WorldRanking) -> str:
    """The ranked rows that fail, swing or chatter in some world, with their shares."""
    stands = ranking.standing
    some = [index for index in stands.order if stands.fate(index) != "unreliable" and stands.lost[index].times]
    shares = [f"{ranking.rows[index].label} in {percent(stands.lost[index])}" for index in some]
    return f" Lost, not shown to be so in more worlds than is tolerated: {', '.join(shares)}." if shares else ""


def _lost(ranking: WorldRanking) -> str:
    """Rows that fail, swing or chatter too often to stand, sorted by their count of worlds."""
    by_count: dict[int, list[str]] = {}
    for index in ranking.standing.unreliable:
        by_count.setdefault(ranking.standing.lost[index].times, []).append(ranking.rows[index].label)
    counts = [f"{count} in {', '.join(by_count[count])}" for count in sorted(by_count, reverse=True)]
    return f" Worlds lost, of {ranking.worlds}: {'; '.join(counts)}." if counts else ""


def _legend(ranking: WorldRanking) -> str:
    from wristctl.simulation.oscillation import FASTEST, LIMIT_CYCLE

    sound = [share.high for share in ranking.standing.swings if not share.times]
    still = f", though none in {ranking.worlds} can be {100.0 * min(sound):.2g} %" if sound else ""
    return (
        "RMSE is the geometric mean over worlds, with its 95 % interval. A world is a wrist and a rig drawn anew, on "
        "which no gains were searched or chosen. A law is lost where the wrist leaves its range, swings by more "
        f"than {_deg(LIMIT_CYCLE)} deg at rest, or where its tensions go from limit to limit and back more than "
        f"{FASTEST:g} times a second; one that is shown to be lost in more worlds than is tolerated (its "
        f"share's 95 % interval lies above) stands nowhere{still}. Rows that are not told apart from the lowest "
        "are with 95 % all that are as good (model confidence set); two of them may be told apart from each other."
    )


def _term(term: str, values: Sequence[TermValue]) -> str:
    pair = f"{values[0].without} -> {values[0].given}"
    return f"{term} ({pair}): {'; '.join(f'{value.family} {value.told}' for value in values)}."


def _shift(shift: OrderShift, varied: str) -> str:
    before, after = shift.best
    where = f"on {varied} " if varied else ""
    lowest = f"{after} stays lowest" if before == after else f"the lowest is {after}, not {before}"
    resolved = f"{shift.resolved} of {shift.pairs} pairs of laws are told apart both times, {shift.reversed} of them"
    order = f"{resolved} the other way round (Kendall's tau of all {shift.tau:.2f})"
    return f"Tuned otherwise {where}({shift.variant}): {order}; {lowest}; all RMSE {shift.ratio:.2f} times."


def _named(ranking: WorldRanking, index: int) -> str:
    return f"{ranking.rows[index].label} {_deg(ranking.means[index].value)}"


def _interval(ranking: WorldRanking, index: int) -> str:
    mean = ranking.means[index]
    return f"{_deg(mean.value)} [{_deg(mean.low)}, {_deg(mean.high)}]"


def _deg(value: float) -> str:
    return degrees(value, 3)
