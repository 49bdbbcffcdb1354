"""What other worlds and motions find again of a ranking, for docs/study.md."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence

from ranking_rows import Rankings, Row, first_group, group, short
from scipy.stats import kendalltau

# Rows of which an order may come out again beyond chance (Kendall's tau, exact, at 5 %).
FEWEST_ORDERED = 5

_CHOOSE = """Choose among what both have in their first groups. What only one has there, it may owe to its worlds or to
the motions that it was tuned for. An order comes out again where Kendall's tau of both is above 0 at 5 %."""


def unsettled(first: Rankings, second: Rankings) -> dict[str, str]:
    """The first groups of the second ranking, of the rigs on which it shares no controller with the first's."""
    apart = [name for name, rows in first.items() if name in second and not _top(rows) & _top(second[name])]
    return {name: _names(_top(second[name])) for name in apart}


def confirmed(first: Rankings, second: Rankings) -> Rankings:
    """The first rankings, whose first groups are what both have there; where both share none, they stay."""
    found = dict(first)
    for name, rows in first.items():
        both = _top(rows) & _top(second.get(name, rows))
        if both:
            apart = _top(rows) - both
            found[name] = [{**row, "group": 2.0} if row["row"] in apart else row for row in rows]
    return found


def asked_again(first: Rankings, second: Rankings, made: str) -> list[str]:
    """The section on other motions: what of the first groups and of the order comes out again."""
    heads = (
        "rig", "in both first groups", "in one alone: family, other motions", "lowest, in the other's first group",
        "worse than the first group: again, not told, the other way round", "do not use: in both, in one alone",
    )  # fmt: skip
    shared = {name: rows for name, rows in first.items() if name in second}
    lines = [_compared(name, rows, second[name]) for name, rows in shared.items()]
    words = [line for name, rows in shared.items() for line in _for_whoever_chooses(name, rows, second[name])]
    return [
        "## Other motions", "", made, "", _CHOOSE, "", *words, "",
        f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *lines, "",
    ]  # fmt: skip


def _top(rows: Sequence[Row]) -> set[str]:
    return {row["row"] for row in rows if group(row) == 1}


def _names(labels: Iterable[str]) -> str:
    return ", ".join(sorted(map(short, labels))) or "none"


def _for_whoever_chooses(name: str, first: Sequence[Row], second: Sequence[Row]) -> list[str]:
    """What two rankings of a rig mean for whoever chooses a controller for it."""
    one, other = _top(first), _top(second)
    both = [row["row"] for row in first_group(first) if row["row"] in other]
    if not both:
        text = f"the first groups share no controller ({_names(one)}; {_names(other)}): of this rig nothing is settled."
    else:
        text = f"in both first groups {_names(both)}{_order(both, first, second)}."
        if one ^ other:
            text += f" In one alone, so not settled: {_names(one ^ other)}."
    return textwrap.wrap(f"- **{name}**: {text}", 120, subsequent_indent="  ")


def _order(labels: Sequence[str], first: Sequence[Row], second: Sequence[Row]) -> str:
    """Whether the order by RMSE within these comes out again, in words; nothing of a single one."""
    if len(labels) < FEWEST_ORDERED:
        return "" if len(labels) == 1 else "; of so few an order cannot be told to come out again"
    errors = [{row["row"]: row["rmse"] for row in rows} for rows in (first, second)]
    found = kendalltau(*([of_study[label] for label in labels] for of_study in errors))
    kept = found.pvalue < 0.05 and found.statistic > 0.0
    words = "their order comes out again" if kept else "the order within them does not, and is not to be read"
    return f"; {words} (Kendall's tau {found.statistic:.2f})"


def _compared(name: str, first: Sequence[Row], second: Sequence[Row]) -> str:
    """A line of the table: groups, lowest, pairs told apart, and what must not be used."""
    top, other_top = _top(first), _top(second)
    lowest = ", ".join(
        f"{short(rows[0]['row'])} {'yes' if rows[0]['row'] in elsewhere else 'no'}" if rows else "none"
        for rows, elsewhere in ((first_group(first), other_top), (first_group(second), top))
    )
    behind = [row["row"] for row in first if (group(row) or 1) > 1]
    places = {row["row"]: group(row) or math.inf for row in second}  # what must not be used comes last
    pairs = [(places[better], places[worse]) for better in top for worse in behind if {better, worse} <= places.keys()]
    kept, turned = sum(one == 1 < other for one, other in pairs), sum(other == 1 < one for one, other in pairs)
    lost, other_lost = ({row["row"] for row in rows if group(row) is None} for rows in (first, second))
    cells = (
        name, str(len(top & other_top)), f"{len(top - other_top)}, {len(other_top - top)}", lowest,
        f"{kept}, {len(pairs) - kept - turned}, {turned}", f"{len(lost & other_lost)}, {len(lost ^ other_lost)}",
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"
