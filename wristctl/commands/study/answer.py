"""The answer of a study of all controllers: which for which rig, what each term buys, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wristctl.commands.answer import Answer, rest
from wristctl.commands.printed_table import Table
from wristctl.commands.ranking_answer import advice, certainty, condition, decided, names_of, not_to_use, winner
from wristctl.commands.ranking_tables import decision_table
from wristctl.comparison.bootstrap import plain
from wristctl.comparison.repeated_tunings import FEWEST_TUNINGS, HALVES
from wristctl.comparison.tuned_ranking import OrderShift, TermValue, TunedRanking

# Share of the worlds by which tunings of a controller differ in those that they lose where that is told; so many.
_OTHERWISE, _NAMED = 0.1, 3


def answer_of(
    rankings: Sequence[TunedRanking],
    terms: Sequence[TermValue],
    shifts: Sequence[OrderShift],
    run: str = "",
    bending: str = "",
) -> Answer | None:
    """The answer of a study for one screen; None where nothing was ranked.

    `shifts` are of the order where controllers were tuned otherwise; `run` is the path, empty for a result in memory;
    `bending` says which families bend in two planes, and why.
    """
    if not rankings:
        return None
    names = names_of(rankings)
    more = rest("Every controller", run)
    notes: list[str | Table] = [
        bending,
        terms_table(terms) if terms else "",
        not_to_use(rankings, names),
        lost_otherwise(rankings),
        f"{certainty(rankings)} {few_tunings(rankings)}".strip(),
        first_again(rankings),
        decided(rankings),
        tuned_otherwise(shifts),
    ]
    return Answer(advice(rankings), decision_table(rankings, names), more=more).fitted(notes)


def lost_otherwise(rankings: Sequence[TunedRanking]) -> str:
    """Of which controllers the published gains are lost in other worlds than those of another tuning; the worst three.

    A row's RMSE is over its tunings, and its failures and swings are of the published gains alone.
    """
    found = []
    for ranking in rankings:
        for row, tunings in enumerate(ranking.lost_of_tunings):
            lost = [one.times for one in tunings]
            own = lost.pop(ranking.published[row])
            other = max(lost, key=lambda times: abs(times - own), default=own)
            if abs(other - own) > _OTHERWISE * ranking.count:
                name = ranking.labels[row].split("/")[0]
                words = f"{name} in {condition(ranking)} {own} of {ranking.count}, with another tuning {other}"
                found.append((abs(other - own) / ranking.count, words))
    if not found:
        return ""
    worst = [words for _, words in sorted(found, key=lambda one: -one[0])[:_NAMED]]
    more = f"; and {len(found) - _NAMED} more" * (len(found) > _NAMED)
    return f"An RMSE is over all tunings, worlds lost are those of the published gains: {'; '.join(worst)}{more}."


def few_tunings(rankings: Sequence[TunedRanking]) -> str:
    """That two tunings tell no interval, where there are no more."""
    if not any(1 < len(tunings) < FEWEST_TUNINGS for ranking in rankings for tunings in ranking.tunings):
        return ""
    return f"Two tunings tell no interval of an RMSE, nor of a ratio: {FEWEST_TUNINGS} or more do (`study.budgets`)."


def first_again(rankings: Sequence[TunedRanking]) -> str:
    """How often the best is first again: in halves of the worlds, and in single tunings of all."""
    facts = []
    for ranking in rankings:
        row = winner(ranking, rankings)
        if row is None or not ranking.may_change:
            continue
        firsts = ranking.firsts[row]
        name = ranking.labels[row].split("/")[0]
        facts.append(f"{condition(ranking)} {name} {firsts.halves} and {firsts.tunings} of {firsts.of_tunings}")
    if not facts:
        return ""
    return f"First in how many of {HALVES} halves of the worlds, and with how many tunings: {'; '.join(facts)}."


def terms_table(terms: Sequence[TermValue]) -> Table:
    """A term a line: how many times less the RMSE is with it in each family; undecided where the interval holds 1."""
    families, names = (list(dict.fromkeys(getattr(one, key) for one in terms)) for key in ("family", "term"))
    values = {(one.term, one.family): one.times for one in terms}

    def cell(term: str, family: str) -> str:
        times = values.get((term, family))
        if times is None:
            return "-"
        return "undecided" if times.is_one or not math.isfinite(times.value) else plain(times.value)

    rows = [(term, *(cell(term, family) for family in families)) for term in names]
    places = [family.replace(", steps", " (steps)") for family in families]
    return Table("", ("times less RMSE (below 1: more) by", *places), rows)


def tuned_otherwise(shifts: Sequence[OrderShift]) -> str:
    """How many pairs of controllers change their order where they are tuned otherwise."""
    if not shifts:
        return ""
    each = [f"{shift.reversed} of {shift.resolved} ({shift.variant})" for shift in shifts]
    return f"Tuned otherwise, so many of the pairs of controllers told apart change their order: {', '.join(each)}."
