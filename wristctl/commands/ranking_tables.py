"""Rankings as tables and figures: the answer's, every row over worlds, and which controller for which rig."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from wristctl.commands.printed_table import COLUMNS, Table, degrees, joined, two
from wristctl.commands.ranking_answer import (
    DIGITS,
    condition,
    error,
    fault_words,
    first_group,
    names_of,
    recommended,
    winner,
    with_interval,
)
from wristctl.commands.results import Findings
from wristctl.comparison.controller_ranking import Ranking, labels_of, undominated
from wristctl.comparison.step_cost import StepTime
from wristctl.comparison.world_ranking import WorldRanking

# Controllers that a table on the screen has, at most, unless more were asked for.
_DOZEN = 12
# Lines of a table of which columns may stand below others, at most.
_SHORT = 15


# What a condition's number in brackets is of: a case is a motion that was asked for.
_COUNTED = {"case": "motions", "repetition": "repetitions", "world": "worlds"}


def answer_tables(rankings: Sequence[Ranking]) -> list[Table]:
    """Every controller under each condition; where there are several conditions, the best of each as questions."""
    if not rankings:
        return []
    tree = decision_table(rankings, names_of(rankings), "Which controller for which rig")
    return [standings_table(rankings), *[tree] * (len(tree.rows) > 1)]


def controllers_table(
    rankings: Sequence[Ranking], names: Mapping[str, str], asked: Collection[str] = (), lines: int = 18
) -> Table:
    """A controller a line and a condition a column: RMSE, or what is wrong with it there; the best and ties marked.

    Beyond a dozen controllers it has those to use, the best of each condition, the labels that were `asked` for, and
    then those that tie, as far as there is room. Where that is no short table, and does not fit beside each other in so
    many lines, first intervals go, then steps where there are other motions, then controllers.
    """
    labels = labels_of(rankings)
    best = [ranking.labels[row] for ranking in rankings if (row := winner(ranking, rankings)) is not None]
    tied = [label for ranking in rankings for label in first_group(ranking)]
    order = list(dict.fromkeys([*recommended(rankings), *asked, *best, *tied, *labels]))
    order = [label for label in order if label in labels]
    kept = min(max(_DOZEN, len({*best, *asked} & set(labels))), len(labels))
    smooth = [ranking for ranking in rankings if not ranking.jumps] or rankings
    for count in range(kept, 0, -1):
        shown = [label for label in labels if label in order[:count]]
        for conditions, intervals in ((rankings, True), (rankings, False), (smooth, True), (smooth, False)):
            table = _of_controllers(rankings, conditions, names, shown, intervals)
            height = len(table.text(COLUMNS).split("\n"))
            beside = len(table.within(COLUMNS).columns) == len(table.columns)
            last = conditions is smooth and not intervals
            if height <= (max(lines, count + 6) if beside or last else _SHORT):
                return table
    return table


def _of_controllers(
    rankings: Sequence[Ranking],
    conditions: Sequence[Ranking],
    names: Mapping[str, str],
    labels: Sequence[str],
    intervals: bool,
) -> Table:
    def cell(ranking: Ranking, label: str) -> str:
        if label not in ranking.labels:
            return "-"
        row = ranking.labels.index(label)
        if row in ranking.standing.unusable:
            fault = ranking.fault(row)
            assert fault is not None
            return fault_words(fault, unit=False) if intervals else fault.kind
        mark = " *" if row == winner(ranking, rankings) else " =" if label in first_group(ranking) else ""
        return f"{with_interval(ranking, row) if intervals else error(ranking, row)}{mark}"

    rows = [(names[label], *(cell(ranking, label) for ranking in conditions)) for label in labels]
    given = any("[" in text for row in rows for text in row)
    units = list(dict.fromkeys(_COUNTED[ranking.unit] for ranking in conditions))
    counted = f"; (n): {units[0]}" if len(units) == 1 else ""
    title = f"RMSE [deg]{', 95 % interval' * given}; * best, = tied{counted}"
    left = [f"{len(names) - len(labels)} more controllers"] * (len(names) > len(labels))
    left += ["steps"] * (len(conditions) < len(rankings))
    title += f"; {joined(left)}: --all" if left else ""
    heads = [f"{condition(ranking)} ({ranking.count})" for ranking in conditions]
    return Table(title, ("controller", *heads), rows)


def standings_table(rankings: Sequence[Ranking]) -> Table:
    """A controller a line: its rank and RMSE under each condition, or what is wrong with it there."""
    labels = labels_of(rankings)

    def cell(ranking: Ranking, label: str) -> str:
        if label not in ranking.labels:
            return "-"
        row = ranking.labels.index(label)
        fault = ranking.fault(row)
        if row in ranking.standing.unusable and fault is not None:
            return fault_words(fault, unit=False)
        return f"{ranking.standing.group(row) or '-'}: {with_interval(ranking, row)}"

    rows = [(label, *(cell(ranking, label) for ranking in rankings)) for label in labels]
    title = "Every controller under each condition, rank: RMSE [deg, 95 %]; those of one rank cannot be told apart"
    return Table(title, ("controller", *map(condition, rankings)), rows)


def every_row(ranking: WorldRanking, times: Mapping[str, StepTime] | None = None) -> Table:
    """All rows of a ranking, from best to worst, with intervals, faults and costs.

    `times` are those of a tick, by controller or by row.
    """
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

    Of conditions that a question leaves together the last one stands for all; where none parts any, each has its line.
    """
    ends = _parted(rankings, {})
    asked = [trait for trait in _QUESTIONS if any(trait in answers for answers, _ in ends)]
    heads = ("use", "RMSE [deg], 95 %", "as good", "next, times more")
    rows = [(*(answers.get(trait, "-") for trait in asked), *_leaf(one, rankings, names)) for answers, one in ends]
    if len(rankings) > 1 and not asked:
        return Table(title, ("condition", *heads), [(condition(one), *_leaf(one, rankings, names)) for one in rankings])
    return Table(title, (*(_QUESTIONS[trait] for trait in asked), *heads), rows)


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
    others = [names[ranking.labels[other]] for other in groups[0] if other != row]
    following = "-"
    if len(groups) > 1:
        after = groups[1][0]
        ratio = ranking.means[after].value / ranking.means[row].value
        over = ">" * degrees(ranking.means[row].value).startswith("<")  # the least that is told: it may be far less
        following = f"{names[ranking.labels[after]]} {over}{two(ratio, DIGITS)}"
    equal = "-" if not others else others[0] if len(others) == 1 else f"{len(others)} more"
    return names[ranking.labels[row]], with_interval(ranking, row), equal, following


def draw_rankings(findings: Findings, rankings: Sequence[Ranking], later: bool = False) -> None:
    """Draw the answer, performance profiles, ratios to feedforward, and who beats whom under each condition.

    All but the answer are drawn when somebody asks for them, where `later`; who beats whom always is.
    """
    from wristctl.plotting.ranking_figures import (
        answer_figure,
        paired_ratios,
        performance_profile,
        probability_of_better,
    )

    if not rankings:
        return
    places = {ranking.name: condition(ranking) for ranking in rankings}
    caption = "RMSE of every controller under each condition, the best on top; black crosses must not be used"
    findings.figure("answer", answer_figure, rankings, places_of(rankings), caption=caption)
    findings.overview.figure = "answer"
    unit = rankings[0].unit
    caption = f"Share of the {unit}s in which a controller's RMSE is within a factor of the least one there"
    findings.figure("performance-profile", performance_profile, rankings, places, caption=caption, later=later)
    baseline = next((one.labels[one.yardstick] for one in rankings if one.yardstick is not None), None)
    if baseline is not None and any(len(one.labels) > 1 for one in rankings):
        caption = f"RMSE over feedforward's in the same {unit}s: geometric mean with 95 % interval, and every {unit}"
        findings.figure("ratio-to-feedforward", paired_ratios, rankings, baseline, places, caption=caption, later=later)
    for ranking in rankings:
        name, place = re.sub(r"[^A-Za-z0-9.-]+", "-", ranking.name), places[ranking.name]
        caption = f"Probability that a controller (row) has less RMSE than another (column) in a {unit}: {place}"
        findings.figure(f"probability-{name}", probability_of_better, ranking, place, caption=caption, later=True)


def keep_error(findings: Findings, name: str, ranking: Ranking, row: int, meaning: str = "") -> None:
    """Keep the geometric mean of a row's RMSE, with its interval if it has one, as a metric."""
    mean = ranking.means[row]
    ends = (mean.low, mean.high) if math.isfinite(mean.high) else None
    findings.metric(name, mean.value, "rad", "lower", ranking.count, ends, meaning)


def draw_intervals(findings: Findings, ranking: WorldRanking, end: str) -> None:
    """Draw every row of a ranking over worlds with its interval; `end` follows `ranking` in the figure's name."""
    from wristctl.plotting.ranking_figures import ranking_intervals

    caption = f"RMSE of every controller on {ranking.name}, with 95 % intervals over worlds"
    findings.figure(f"ranking{end}", ranking_intervals, ranking, caption=caption)


def places_of(rankings: Sequence[Ranking]) -> dict[str, str]:
    """Words of each condition, by the name of its ranking, with its best controller in a second line."""
    best = {one.name: one.labels[row] for one in rankings if (row := winner(one, rankings)) is not None}
    return {one.name: condition(one) + (f"\nbest: {best[one.name]}" if one.name in best else "") for one in rankings}
