"""Rankings as tables: the answer's, and every row of a ranking over worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table, degrees, two
from wristctl.commands.ranking_answer import decision_table, ranking_table
from wristctl.commands.ranking_words import DIGITS, condition, error, fact, names_of

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking
    from wristctl.comparison.step_cost import StepTime
    from wristctl.comparison.world_ranking import WorldRanking


def answer_tables(rankings: Sequence[Ranking]) -> list[Table]:
    """The table of the answer with a title, a condition a line; and where there are several, as questions."""
    if not rankings:
        return []
    names = names_of(rankings)
    title = "Best controller under each condition; the ratio is that of feedforward's RMSE to the best one's"
    shown = [replace(ranking_table(rankings, names), title=title)]
    tree = decision_table(rankings, names, "Which controller for which rig")
    return [*shown, tree] if len(tree.rows) > 1 else shown


def standings_table(rankings: Sequence[Ranking]) -> Table:
    """A controller a line: its rank and RMSE under each condition, or what is wrong with it there."""
    labels = list(dict.fromkeys(label for ranking in rankings for label in ranking.labels))

    def cell(ranking: Ranking, label: str) -> str:
        if label not in ranking.labels:
            return "-"
        row = ranking.labels.index(label)
        if row in ranking.standing.unusable:
            return fact(ranking, row)
        return f"{ranking.standing.group(row) or '-'}: {error(ranking, row)}"

    rows = [(label, *(cell(ranking, label) for ranking in rankings)) for label in labels]
    title = "Every controller under each condition, rank: RMSE [deg]; those of one rank cannot be told apart"
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
