"""What a study of all laws found, in words: which law for which rig, what cannot be told, and what each term buys."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wristctl.comparison.geometric_means import GeometricMean
    from wristctl.comparison.order_shifts import OrderShift
    from wristctl.comparison.term_values import TermValue
    from wristctl.comparison.world_ranking import WorldRanking

COLUMNS, _NAMED = 100, 4
"""Width of a line; rows of a tie, or of those that fail, that are named."""


def answer(rankings: Mapping[str, WorldRanking], terms: Sequence[TermValue], shifts: Sequence[OrderShift]) -> list[str]:
    """A sentence or two for each rig, then what each term buys, then how far the order can be relied on, in lines."""
    said = [f"{family} ({found.family.about}): {_rig(found)}" for family, found in rankings.items()]
    names = dict.fromkeys(value.term for value in terms)
    said += [_term(name, [value for value in terms if value.term == name]) for name in names]
    said += [_shift(each) for each in shifts]
    lines: list[str] = []
    for each in said:
        lines += ["", *textwrap.wrap(each, COLUMNS, break_long_words=False, break_on_hyphens=False)]
    return lines[1:]


def quietest(found: WorldRanking, rows: Sequence[int]) -> int:
    """Of these rows the one that moves the tensions of its tendons least."""
    import numpy as np

    return min(rows, key=lambda at: float(np.nanmedian(found.rows[at].measured.metrics["chattering"])))


def _rig(found: WorldRanking) -> str:
    stands = found.standing
    lost = [_fate(found, at) for at in stands.unreliable]
    more = f", and {len(lost) - _NAMED} more" if len(lost) > _NAMED else ""
    fates = f" Not to be relied on: {', '.join(lost[:_NAMED])}{more}." if lost else ""
    if not stands.groups:
        return f"run none of these.{fates}"
    best = stands.groups[0].rows
    first, gain, mean = best[0], found.gains[best[0]], found.means[best[0]]
    error = f"RMSE {_deg(mean.value)} [{_deg(mean.low)}, {_deg(mean.high)}] deg"
    if found.yardstick in best:
        return f"run feedforward: no law is better by what could be told; {error}.{_floor(found)}{fates}"
    said = f"run {found.rows[first].label}: {error}, {_times(gain)} times less than feedforward."
    if len(best) > 1:
        names = [found.rows[at].label for at in best[1 : 1 + _NAMED]]
        names += [f"{len(best) - 1 - _NAMED} more"] if len(best) - 1 > _NAMED else []
        said += f" As good by what could be told: {', '.join(names)}; of these all"
        said += f" {found.rows[quietest(found, best)].label} moves the tendons least."
    if len(stands.groups) > 1:
        after = stands.groups[1].rows[0]
        said += f" Next is {found.rows[after].label} with {_deg(found.means[after].value)} deg."
    return f"{said}{_floor(found)}{fates}"


def _floor(found: WorldRanking) -> str:
    floor = found.standing.floor
    if not math.isfinite(floor):
        return ""
    return f" Differences below {100.0 * (floor - 1.0):.2g} % cannot be told in {found.worlds} worlds."


def _fate(found: WorldRanking, at: int) -> str:
    failures, swings = found.standing.failures[at], found.standing.swings[at]
    told = [
        f"{what} in {_percent(each.value)} [{_percent(each.low)}, {_percent(each.high)}] % of worlds"
        for what, each in (("fails", failures), ("swings", swings))
        if each.times
    ]
    return f"{found.rows[at].label} ({' and '.join(told)})"


def _term(term: str, values: Sequence[TermValue]) -> str:
    pair = f"{values[0].given} beside {values[0].without}"
    return f"What {term} buys ({pair}): {'; '.join(f'{each.family}: {each.told}' for each in values)}."


def _shift(shift: OrderShift) -> str:
    before, after = shift.best
    same = f"{before} stays best" if before == after else f"best is {after}, not {before}"
    told = f"of {shift.resolved} pairs of laws that are told apart both ways {shift.reversed} change places"
    order = f"{told}, rank correlation {shift.tau:.2f}; {same}"
    return f"Tuned otherwise ({shift.variant}): {order}; RMSE {shift.ratio:.3g} times."


def _times(gain: GeometricMean) -> str:
    value, low, high = (f"{each:.3g}" if each < 1000.0 else f"{each:.0f}" for each in (gain.value, gain.low, gain.high))
    return f"{value} [{low}, {high}]"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f}" if share >= 0.1 else f"{100.0 * share:.2g}"


def _deg(value: float) -> str:
    return f"{math.degrees(value):.2g}"
