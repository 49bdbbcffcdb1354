"""Rankings as tables: the answer's, and every row of a ranking over worlds."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import COLUMNS, Table, degrees, two
from wristctl.commands.ranking_words import (
    DIGITS,
    condition,
    error,
    fact,
    first_group,
    is_by_loop,
    names_of,
    short_fact,
    winner,
    with_interval,
)

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking
    from wristctl.comparison.step_cost import StepTime
    from wristctl.comparison.world_ranking import WorldRanking


def answer_tables(rankings: Sequence[Ranking]) -> list[Table]:
    """Every controller under each condition; the best of each condition; where there are several, as questions."""
    if not rankings:
        return []
    names = names_of(rankings)
    title = "Best controller under each condition; the ratio is that of feedforward's RMSE to the best one's"
    shown = [standings_table(rankings), replace(ranking_table(rankings, names), title=title)]
    tree = decision_table(rankings, names, "Which controller for which rig")
    return [*shown, tree] if len(tree.rows) > 1 else shown


# Controllers that a table on the screen has, at most, unless more were asked for.
_DOZEN = 12


def controllers_table(
    rankings: Sequence[Ranking], names: Mapping[str, str], asked: Collection[str] = (), lines: int = 18
) -> Table:
    """A controller a line and a condition a column: RMSE, or what is wrong with it there; the best and ties marked.

    It takes at most so many lines, if that can be.
    Beyond a dozen controllers the best of each condition, the labels that were `asked` for, and, as far as there is
    room, those that tie. Intervals are left out where they do not fit. Where no controller fits, each condition is a
    line.
    """
    labels = list(dict.fromkeys(label for ranking in rankings for label in ranking.labels))
    best = [ranking.labels[row] for ranking in rankings if (row := winner(ranking, rankings)) is not None]
    tied = [label for ranking in rankings for label in first_group(ranking)]
    order = [label for label in dict.fromkeys([*best, *asked, *tied, *labels]) if label in labels]
    kept = max(_DOZEN, len({*best, *asked} & set(labels)))
    for count in range(min(kept, len(labels)), min(2, len(labels)) - 1, -1):
        shown = [label for label in labels if label in order[:count]]
        for intervals in (True, False):
            table = _of_controllers(rankings, names, shown, intervals, len(labels) - count)
            if len(table.text(COLUMNS).split("\n")) <= max(lines, count + 4 if count > _DOZEN else 0):
                return table
    return ranking_table(rankings, names)


def ranking_table(rankings: Sequence[Ranking], names: Mapping[str, str]) -> Table:
    """A condition a line: the best, how many tie, the next, feedforward, and how many must not be used."""
    unit = "worlds" if rankings[0].unit == "world" else "cases"
    heads = (
        f"condition ({unit})",
        "best",
        "ties",
        "next",
        "feedforward (ratio)",
        "unusable",
    )
    rows = []
    for ranking in rankings:
        row, groups, base = winner(ranking, rankings), ranking.standing.groups, ranking.yardstick
        why = "no ranking: too few" if ranking.standing.untold else "none"
        best = why if row is None else f"{names[ranking.labels[row]]} {error(ranking, row)}"
        after = groups[1][0] if len(groups) > 1 else None
        following = "-" if after is None else f"{names[ranking.labels[after]]} {error(ranking, after)}"
        bound = ">" if best.endswith(degrees(0.0)) else ""
        ratio = "" if row is None or base is None else f" ({bound}{two(ranking.gains[row].value, DIGITS)})"
        open_loop = "-" if base is None else f"{error(ranking, base)}{ratio}"
        others = f"{len(groups[0]) - 1}" if groups else "-"
        begin, end = (
            f"{condition(ranking)} ({ranking.count})",
            f"{len(ranking.standing.unusable)} of {len(ranking.labels)}",
        )
        rows.append((begin, best, others, following, open_loop, end))
    title = "RMSE [deg]; ties: not significantly different from the best; next: first that is; ratio: to the best"
    return Table(title, heads, rows)


def _of_controllers(
    rankings: Sequence[Ranking], names: Mapping[str, str], labels: Sequence[str], intervals: bool, more: int
) -> Table:
    def cell(ranking: Ranking, label: str) -> str:
        if label not in ranking.labels:
            return "-"
        row = ranking.labels.index(label)
        if row in ranking.standing.unusable:
            return short_fact(ranking, row)
        mark = " *" if row == winner(ranking, rankings) else " =" if label in first_group(ranking) else ""
        return f"{with_interval(ranking, row) if intervals else error(ranking, row)}{mark}"

    rows = [(names[label], *(cell(ranking, label) for ranking in rankings)) for label in labels]
    given = any("[" in text for row in rows for text in row)
    title = f"RMSE [deg]{', 95 % interval' * given}; * best, = tied with it"
    if any(is_by_loop(label) for label in labels):
        title += "; name alone: default if exact, else hardware"
    if more:
        title += f"; {more} more: --all"
    heads = [f"{condition(ranking)} ({ranking.count})" for ranking in rankings]
    return Table(title, ("controller", *heads), rows)


def standings_table(rankings: Sequence[Ranking]) -> Table:
    """A controller a line: its rank and RMSE under each condition, or what is wrong with it there."""
    labels = list(dict.fromkeys(label for ranking in rankings for label in ranking.labels))

    def cell(ranking: Ranking, label: str) -> str:
        if label not in ranking.labels:
            return "-"
        row = ranking.labels.index(label)
        if row in ranking.standing.unusable:
            return fact(ranking, row)
        return f"{ranking.standing.group(row) or '-'}: {with_interval(ranking, row)}"

    rows = [(label, *(cell(ranking, label) for ranking in rankings)) for label in labels]
    title = "Every controller under each condition, rank: RMSE [deg, 95 %]; those of one rank cannot be told apart"
    return Table(title, ("controller", *map(condition, rankings)), rows)


def every_row(ranking: WorldRanking, times: Mapping[str, StepTime] | None = None) -> Table:
    """All rows of a ranking, from best to worst, with intervals, faults and costs.

    `times` are those of a tick, by controller or by row.
    """
    import numpy as np

    from wristctl.comparison.controller_ranking import undominated

    energy, chattering = ranking.medians("energy"), ranking.medians("chattering")
    rmse = np.array([estimate.value for estimate in ranking.means])
    front = undominated(np.column_stack([rmse, chattering, energy]))
    rows = []
    for row in ranking.standing.order:
        mean, gain, group = ranking.means[row], ranking.gains[row], ranking.standing.group(row)
        failures, swings = ranking.standing.failures[row], ranking.standing.swings[row]
        lost = [f"{100 * share.value:.3g} % (< {100 * share.high:.2g})" for share in (failures, swings)]
        name, known = ranking.labels[row], times or {}
        tick = known.get(name, known.get(name.split("/")[0]))
        ends = [degrees(end, DIGITS) if mean.high < np.inf else "-" for end in (mean.low, mean.high)]
        ratio = f"{two(gain.low, DIGITS)} to {two(gain.high, DIGITS)}" if gain.high < np.inf else "-"
        rows.append((
            "-" if group is None else str(group), ranking.labels[row], degrees(mean.value, DIGITS), *ends,
            degrees(float(ranking.scores[row].max()), DIGITS), gain.value, ratio, *lost, chattering[row], energy[row],
            *(f"{100.0 * shares[row]:.3g} %" for shares in ranking.at_limit.values()),
            tick.median if tick else None, tick.p99 if tick else None, "yes" if front[row] and group else "",
        ))  # fmt: skip
    heads = (
        "group", "controller", "RMSE [deg]", "95 % low", "high", "worst", "times less than feedforward", "95 %",
        "fails", "swings or chatters", "tension [N/s]", "work [J]",
        *(f"at limit of {limit}" for limit in ranking.at_limit), "tick [us]", "tick, P99 [us]", "undominated",
    )  # fmt: skip
    title = f"{condition(ranking)}: {ranking.count} held-out worlds, {ranking.motions} motions each"
    return Table(title, heads, rows)


# Questions that a builder of a rig can answer, in the order in which they are asked.
_QUESTIONS = {
    "rig": "camera?",
    "jumps": "steps?",
    "load": "push?",
    "unknown": "wrong model?",
    "uneven": "uneven wrist?",
}


def decision_table(rankings: Sequence[Ranking], names: Mapping[str, str], title: str = "") -> Table:
    """Questions whose answers part the conditions, and for each answer what to use, its RMSE and the next.

    Of conditions that no question parts the last one stands for all.
    """
    ends = _parted(rankings, {})
    asked = [trait for trait in _QUESTIONS if any(trait in answers for answers, _ in ends)]
    heads = (*(_QUESTIONS[trait] for trait in asked), "use", "RMSE [deg], 95 %", "as good", "next, times more")
    rows = [(*(answers.get(trait, "-") for trait in asked), *_leaf(one, rankings, names)) for answers, one in ends]
    return Table(title, heads, rows)


def _parted(rankings: Sequence[Ranking], answers: dict[str, str]) -> list[tuple[dict[str, str], Ranking]]:
    """The conditions at the ends of the tree of questions, with the answers that lead there."""
    for trait in _QUESTIONS:
        sides = {"yes": [one for one in rankings if getattr(one.traits, trait)]}
        sides["no"] = [one for one in rankings if not getattr(one.traits, trait)]
        if all(sides.values()):
            return [end for answer, side in sides.items() for end in _parted(side, {**answers, trait: answer})]
    return [(answers, rankings[-1])]


def _leaf(ranking: Ranking, rankings: Sequence[Ranking], names: Mapping[str, str]) -> tuple[str, ...]:
    row, groups = winner(ranking, rankings), ranking.standing.groups
    if row is None:
        return "too few to rank" if ranking.standing.untold else "none", "", "", ""
    mean = ranking.means[row]
    ends = f" [{degrees(mean.low, DIGITS)}, {degrees(mean.high, DIGITS)}]" if mean.low < mean.high < math.inf else ""
    others = [names[ranking.labels[other]] for other in groups[0] if other != row]
    following = "-"
    if len(groups) > 1:
        after = groups[1][0]
        following = f"{names[ranking.labels[after]]} {two(ranking.means[after].value / mean.value, DIGITS)}"
    equal = "-" if not others else others[0] if len(others) == 1 else f"{len(others)} more"
    return names[ranking.labels[row]], f"{degrees(mean.value, DIGITS)}{ends}", equal, following
