"""What a second study of the same question finds again: the paragraph and the section of docs/study.md."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence

from ranking_rows import Rankings, Row, first_group, group, interval, short
from scipy.stats import kendalltau

from wristctl.commands.printed_table import joined

# Of equally sure estimates of the same, how many lie within the other's 95 % interval: P(|z| < 1.96 / sqrt(2)).
NOMINAL = 83
# Rows of which an order may come out again beyond chance (Kendall's tau, exact, at 5 %), and disagreements shown.
FEWEST_ORDERED, LARGEST = 5, 5

_CHOOSE = """Choose among what both studies have in their first groups. What only one has there, it may owe to its
worlds or to the luck of its searches. An order comes out again where Kendall's tau of both is above 0 at 5 %."""


def unsettled(first: Rankings, second: Rankings) -> dict[str, str]:
    """What the second study has in its first group, of the rigs on which it shares no controller with the first."""
    apart = [name for name, rows in first.items() if name in second and not _top(rows) & _top(second[name])]
    return {name: _names(_top(second[name])) for name in apart}


def again(first: Rankings, second: Rankings, rigs: Sequence[str]) -> list[str]:
    """Which controllers are in the first group of all these rigs in both studies, as a paragraph."""
    if not rigs:
        return []
    one, other = (set.intersection(*(_top(rankings[name]) for name in rigs)) for rankings in (first, second))
    where = f"each of {joined(rigs)}" if len(rigs) > 1 else rigs[0]
    text = f"""[A second study](#asked-twice) has other worlds, tunings and noise. On {where} none is shown to be better
        than, in both studies, {_names(one & other)}; in this one only, {_names(one - other)}; in the other only,
        {_names(other - one)}."""
    return [*textwrap.wrap(" ".join(text.split()), 120), ""]


def asked_twice(first: Rankings, second: Rankings, made: str) -> list[str]:
    """The section on a second study: what of the first groups, of the order and of the intervals comes out again."""
    heads = (
        "rig", "in both first groups", "in one alone: first, second study", "lowest, in the other's first group",
        "worse than the first group: again, not told, the other way round", "do not use: in both, in one alone",
    )  # fmt: skip
    shared = {name: rows for name, rows in first.items() if name in second}
    lines = [_compared(name, rows, second[name]) for name, rows in shared.items()]
    words = [line for name, rows in shared.items() for line in _for_whoever_chooses(name, rows, second[name])]
    return [
        "## Asked twice", "", made, "", _CHOOSE, "", *words, "",
        f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *lines, "", *_intervals(shared, second), "",
    ]  # fmt: skip


def _top(rows: Sequence[Row]) -> set[str]:
    return {row["row"] for row in rows if group(row) == 1}


def _names(labels: Iterable[str]) -> str:
    return ", ".join(sorted(map(short, labels))) or "none"


def _for_whoever_chooses(name: str, first: Sequence[Row], second: Sequence[Row]) -> list[str]:
    """What two studies of a rig mean for whoever chooses a controller for it."""
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


def _intervals(first: Rankings, second: Rankings) -> list[str]:
    """How many RMSE lie within the other study's intervals, how many differ beyond both, and which differ most."""
    pairs = []
    for name, rows in first.items():
        others = {row["row"]: row for row in second[name]}
        pairs += [(name, row, others[row["row"]]) for row in rows if row["row"] in others]
    pairs = [pair for pair in pairs if _sure(pair[1]) and _sure(pair[2])]
    within = [
        sum(other["rmse_low"] <= one["rmse"] <= other["rmse_high"] for _, one, other in pairs),
        sum(one["rmse_low"] <= other["rmse"] <= one["rmse_high"] for _, one, other in pairs),
    ]
    sizes = sorted(((_apart(one, other), name, one, other) for name, one, other in pairs), key=lambda size: -size[0])
    beyond = sum(size > 1.0 for size, *_ in sizes)
    text = f"""Of {len(pairs)} RMSE, each of a controller on a rig, {within[0]} of the first study lie within the 95 %
        interval of the second, and {within[1]} of the second within that of the first; of right intervals of the same
        width it would be {NOMINAL} %, {round(NOMINAL * len(pairs) / 100)}. By both intervals together {beyond} differ;
        of right intervals it would be 5 %, {round(0.05 * len(pairs))}. The largest differences, over what both
        intervals allow:"""
    lines = ["| rig | controller | RMSE [deg], first study | second study | difference over the allowed |"]
    lines += ["| --- | --- | --- | --- | --- |"]
    lines += [
        f"| {name} | {short(one['row'])} | {interval(one)} | {interval(other)} | {size:.2g} |"
        for size, name, one, other in sizes[:LARGEST]
    ]
    return [*textwrap.wrap(" ".join(text.split()), 120), "", *lines]


def _sure(row: Row) -> bool:
    """Whether a row's RMSE has an interval."""
    return bool(row["rmse_low"] < row["rmse_high"] < math.inf)


def _apart(one: Row, other: Row) -> float:
    """Difference of the logarithms of two RMSE over the half widths of their intervals that face each other."""
    low, high = sorted((one, other), key=lambda row: float(row["rmse"]))
    allowed = math.hypot(math.log(low["rmse_high"] / low["rmse"]), math.log(high["rmse"] / high["rmse_low"]))
    return math.log(high["rmse"] / low["rmse"]) / allowed
