"""What a study of all laws found, in words: which law for which rig, what cannot be told, and what each term buys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import degrees, in_lines, percent

if TYPE_CHECKING:
    from wristctl.comparison.paired_worlds import OrderShift, TermValue
    from wristctl.comparison.world_ranking import WorldRanking

PAPERS = "smc/tuned"
"""The paper's law, with gains that were searched for as those of all others."""


def answer(
    rankings: Mapping[str, WorldRanking],
    terms: Sequence[TermValue],
    shifts: Sequence[OrderShift],
    varied: str = "",
) -> list[str]:
    """Which law for which rig, what each term buys, and how far the order can be relied on (on the rig `varied`)."""
    said = [f"{family} ({found.family.about}): {_rig(found)}" for family, found in rankings.items()]
    said += [_legend(found) for found in list(rankings.values())[:1]]
    names = list(dict.fromkeys(value.term for value in terms))
    if names:
        said.append(
            "What a term buys: RMSE without it over RMSE with it, above 1 the better; undecided where the interval "
            "holds 1; lost are the worlds in which the law fails, swings or chatters, without -> with it."
        )
    said += [_term(name, [value for value in terms if value.term == name]) for name in names]
    said += [_shift(each, varied) for each in shifts]
    lines: list[str] = []
    for each in said:
        lines += ["", *in_lines(each)]
    return lines[1:]


def quietest(found: WorldRanking, rows: Sequence[int]) -> int:
    """Of these rows the one that moves the tensions of its tendons least."""
    import numpy as np

    return min(rows, key=lambda at: float(np.nanmedian(found.rows[at].measured.metrics["chattering"])))


def _rig(found: WorldRanking) -> str:
    from wristctl.comparison.geometric_means import plain

    groups = found.standing.groups
    if not groups:
        return f"{_none(found)}{_lost(found)}"
    best, known = groups[0], found.yardstick
    first, ties = best[0], [at for at in best[1:] if at != known]
    if known in best:
        said = f"run feedforward, {_interval(found, known)} deg: no law is told apart from it for the better."
        said += f" The lowest is {_named(found, first)}." if first != known else ""
    else:
        gain = found.gains[first]
        times = f"{plain(gain.value)} [{plain(gain.low)}, {plain(gain.high)}]"
        said = f"run {found.rows[first].label}: RMSE {_interval(found, first)} deg, {times} times below feedforward's"
        said += f" {_deg(found.means[known].value)}."
    if ties:
        said += f" Not told apart from it: {', '.join(_named(found, at) for at in ties)}."
        said += f" Of all these {found.rows[quietest(found, best)].label} moves the tendons least."
    if len(groups) > 1:
        said += f" Told apart, the nearest: {_named(found, groups[1][0])}."
    papers = next((at for at, row in enumerate(found.rows) if row.label == PAPERS and at not in best), None)
    if papers is not None:
        ratio = found.means[papers].value / found.means[first].value
        said += f" The paper's law, tuned: {_deg(found.means[papers].value)}, {plain(ratio)} times the lowest."
    return f"{said}{_floor(found)}{_seldom(found)}{_lost(found)}"


def _none(found: WorldRanking) -> str:
    """Why nothing is recommended."""
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    if not found.standing.untold:
        return "run none of these."
    names = ", ".join(_named(found, at) for at in found.standing.untold)
    return f"{found.worlds} worlds are too few to tell apart {names}: {LEAST_PAIRS} or more."


def _floor(found: WorldRanking) -> str:
    floor = found.standing.floor
    known = math.isfinite(floor)
    return f" As a rule differences of {100.0 * (floor - 1.0):.2g} % or more are told apart." if known else ""


def _seldom(found: WorldRanking) -> str:
    """The ranked rows that fail, swing or chatter in some world, with their shares."""
    stands = found.standing
    some = [at for at in stands.order if stands.fate(at) != "unreliable" and stands.lost[at].times]
    each = [f"{found.rows[at].label} in {percent(stands.lost[at])}" for at in some]
    return f" Lost, not shown to be so in more worlds than is tolerated: {', '.join(each)}." if each else ""


def _lost(found: WorldRanking) -> str:
    """Every row that fails, swings or chatters too often to stand, by how often."""
    by_count: dict[int, list[str]] = {}
    for at in found.standing.unreliable:
        by_count.setdefault(found.standing.lost[at].times, []).append(found.rows[at].label)
    each = [f"{count} in {', '.join(by_count[count])}" for count in sorted(by_count, reverse=True)]
    return f" Worlds lost, of {found.worlds}: {'; '.join(each)}." if each else ""


def _legend(found: WorldRanking) -> str:
    from wristctl.simulation.oscillation import FASTEST, LIMIT_CYCLE

    sound = [share.high for share in found.standing.swings if not share.times]
    still = f", though none in {found.worlds} can be {100.0 * min(sound):.2g} %" if sound else ""
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
    return f"{term} ({pair}): {'; '.join(f'{each.family} {each.told}' for each in values)}."


def _shift(shift: OrderShift, varied: str) -> str:
    before, after = shift.best
    where = f"on {varied} " if varied else ""
    lowest = f"{after} stays lowest" if before == after else f"the lowest is {after}, not {before}"
    told = f"{shift.resolved} of {shift.pairs} pairs of laws are told apart both times, {shift.reversed} of them"
    order = f"{told} the other way round (Kendall's tau of all {shift.tau:.2f})"
    return f"Tuned otherwise {where}({shift.variant}): {order}; {lowest}; all RMSE {shift.ratio:.2f} times."


def _named(found: WorldRanking, at: int) -> str:
    return f"{found.rows[at].label} {_deg(found.means[at].value)}"


def _interval(found: WorldRanking, at: int) -> str:
    mean = found.means[at]
    return f"{_deg(mean.value)} [{_deg(mean.low)}, {_deg(mean.high)}]"


def _deg(value: float) -> str:
    return degrees(value, 3)
