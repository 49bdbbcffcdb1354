"""The answer of a comparison in words: which law is best in which class of conditions, by how much, and who fails."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container, Iterable, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import COLUMNS, Table, degrees, in_lines, two
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    from wristctl.comparison.class_standing import ClassStanding
    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.step_cost import StepTime


# Lines of a terminal that an answer may take.
LINES = 32
# Laws of growing complexity: the worth of a term is the gain over the rung below.
LADDER = ("feedforward", "pd-ff", "pid-ff", "pid-dob", "smc-dob")
# Name of the paper's own law, and of the gains that it prints.
PAPERS, PRINTED = "smc", "printed"
_INDENT = "    "
_WIDTH = COLUMNS - len(_INDENT)
# Mark before a row that is not told apart from the best of its place.
_EQUAL = "="
# Blank at which no line ends.
_HELD = "\u00a0"
_WHERE = "every row and metric: --all prints them, the run's report.html sorts and filters them"


def answer_lines(standings: Sequence[ClassStanding]) -> list[str]:
    """At most LINES lines of at most COLUMNS columns; empty where nothing was judged."""
    if not standings:
        return []
    from wristctl.simulation.oscillation import LIMIT_CYCLE

    names, swing = _names(standings), deg(LIMIT_CYCLE)
    head = [
        "RMSE [deg], geometric mean [95 % interval], best first; = not told apart from the best of its place;",
        f"no place: fails, limit-cycles (> {swing} deg at rest), chatters, is short, not physical; no n/m: in all",
    ]
    end = [
        *wrapped(_printed(standings), 2),
        *wrapped(_papers_places(standings, names), 2),
        *wrapped(_papers_order(standings), 1),
    ]
    end.append(_WHERE)
    room = LINES - len(head) - len(end)
    rooms = [max(1, room // len(standings))] * len(standings)
    for index in sorted(
        range(len(standings)), key=lambda place: -len(wrapped(_lost(standings[place], names), LINES, _WIDTH))
    ):
        rooms[index] += sum(rooms) < room
    blocks = [_block(standing, names, allowed) for standing, allowed in zip(standings, rooms, strict=True)]
    return [*head, *[line for block in blocks for line in block][:room], *end]


def head_with_the_best(findings: Findings, standings: Sequence[ClassStanding]) -> None:
    """Let the run's page be headed by the error of the best row of each class."""
    names: list[str] = []
    for standing in standings:
        if standing.standing.groups:
            best = standing.standing.groups[0][0]
            mean, names = standing.means[best], [*names, f"best_{standing.name.replace(',', '').replace(' ', '_')}"]
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            meaning = f"RMSE of {standing.labels[best]}, the best row there, over {standing.cells}"
            findings.metric(names[-1], mean.value, "rad", "lower", standing.scores.shape[1], interval, meaning)
    findings.headline(*names)


def _names(standings: Sequence[ClassStanding]) -> dict[str, str]:
    """Short name of each row: its law alone where the law has no other row; printed gains are always named."""
    labels = dict.fromkeys(label for standing in standings for label in standing.labels)
    laws = Counter(label.split("/")[0] for label in labels)
    alone = {label for label in labels if laws[label.split("/")[0]] == 1 and not label.endswith(f"/{PRINTED}")}
    return {label: label.split("/")[0] if label in alone else label.removesuffix("/default") for label in labels}


def _block(standing: ClassStanding, names: dict[str, str], room: int) -> list[str]:
    """Groups in order, who has no place (of both as much as there is room for), and what the best one buys."""
    name = f"{standing.name} ({standing.cells}): "
    groups, lost, bought = _groups(standing, names), _lost(standing, names), _buys(standing, names)
    below = (room - 1 if room < 3 else room - 2) if room > 1 else 0
    lines = wrapped(lost, below, _WIDTH) if below else []
    ends = wrapped(bought, 1, _WIDTH) if len(lines) < room - 1 else []
    lines = [*wrapped([name + groups[0], *groups[1:]], room - len(lines) - len(ends), _WIDTH), *lines, *ends]
    return [line if number == 0 else f"{_INDENT}{line}" for number, line in enumerate(lines)]


def _groups(standing: ClassStanding, names: dict[str, str]) -> list[str]:
    """Pieces of text, one a row: the best of a group with the group's number, then the tied rows after =."""
    if untold := standing.standing.untold:
        return _untold(
            standing, [f"{names[standing.labels[row]]} {degrees(standing.means[row].value)}" for row in untold]
        )
    if not standing.standing.groups:
        return ["nothing has a place"]
    pieces = []
    for number, group in enumerate(standing.standing.groups, start=1):
        for place, row in enumerate(group):
            mean = standing.means[row]
            bounded = number == 1 and place == 0 and math.isfinite(mean.high) and mean.high > mean.low
            ends = f" [{degrees(mean.low)}, {degrees(mean.high)}]" if bounded else ""
            begin = f"{_EQUAL}{_HELD}" if place else f"{number}.{_HELD}"
            pieces.append(f"{begin}{names[standing.labels[row]]} {degrees(mean.value)}{ends}")
    return pieces


def _untold(standing: ClassStanding, rows: list[str]) -> list[str]:
    """Statement that too few motions were run to tell these rows apart, least error first, with a remedy."""
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    n, unit = standing.scores.shape[1], standing.cells.split()[1].rstrip("s")
    more = "more motions or --repetitions" if standing.loops else "more worlds"
    sentence = f"too few {unit}s to tell (n={n}, {LEAST_PAIRS} at least): {more}; least error first, not ranked:"
    return [f"{sentence} {rows[0]},", *(f"{row}," for row in rows[1:])]


def _lost(standing: ClassStanding, names: dict[str, str]) -> list[str]:
    """Who has no place: each row once, with in how many motions where not in all."""
    stands, motions = standing.standing, standing.motions
    called = [names[label] for label in standing.labels]

    def among(times: int, count: int) -> str:
        return "" if times == count else f" {times}/{count}"

    unreliable: dict[str, list[str]] = {"fails": [], **{kind: [] for kind in standing.unsound}}
    for row in stands.unreliable:
        sizes = {"limit cycle": f" +-{deg(standing.swing[row])} deg", "chatters": f" {two(standing.chatter[row])}/s"}
        n, times = stands.lost[row].n, {"fails": stands.failures[row].times}
        times |= {kind: int(counts[row]) for kind, counts in standing.unsound.items()}
        first, *other_kinds = [kind for kind, count in times.items() if count]
        shown = {kind: f"{kind}{sizes.get(kind, '')}".removeprefix("limit cycle ") for kind in other_kinds}
        also = ", ".join(f"{wording} in {times[kind]}/{n}" for kind, wording in shown.items())
        entry = f"{called[row]}{sizes.get(first, '')}{among(times[first], n)}"
        unreliable[first].append(entry + f" ({also})" * bool(also))
    kinds = unreliable | {
        "does not arrive": [f"{called[row]}{among(int(standing.away[row]), motions)}" for row in stands.short],
        "no tendon bears it": [f"{called[row]} {standing.peak[row]:.2g} N" for row in stands.unphysical],
    }
    pieces = []
    for kind, rows in kinds.items():
        pieces += [
            f"{'' if index else f'{kind}: '}{row}{',' * (index < len(rows) - 1)}" for index, row in enumerate(rows)
        ]
    return pieces


def _buys(standing: ClassStanding, names: dict[str, str]) -> list[str]:
    """Errors of the next place, of feedforward and of the rungs of the ladder, over that of the best row."""
    groups = standing.standing.groups
    if not groups:
        return []
    best = groups[0][0]
    rungs = {name: row for name in LADDER if (row := standing.best(name)) is not None and row != best}
    following = [groups[1][0]] if len(groups) > 1 else []
    pieces: list[str] = []
    for row in dict.fromkeys([*following, *rungs.values()]):
        ratio, name = standing.times_better(best, row), names[standing.labels[row]]
        bounded = name == LADDER[0] and math.isfinite(ratio.high)
        times = f"{ratio.value:.2f}" if ratio.value < 10.0 else two(ratio.value)
        pieces.append(f"{name} x{times}" + f" [{two(ratio.low)}, {two(ratio.high)}]" * bounded + ",")
    least = degrees(standing.means[best].value)
    beside = f"{names[standing.labels[best]]}'s" if not least.startswith("<") else f"{least[1:]} deg"
    return [f"errors over {beside}: {pieces[0]}", *pieces[1:]] if pieces else []


def _printed(standings: Sequence[ClassStanding]) -> list[str]:
    """Fates of the paper's printed gains, with the number of classes of each fate; the numbers add up to all."""
    sentences: list[str] = []
    for label in dict.fromkeys(
        label for standing in standings for label in standing.labels if label.endswith(f"/{PRINTED}")
    ):
        fates = [
            standing.standing.fate(standing.labels.index(label)) for standing in standings if label in standing.labels
        ]
        words = {"unreliable": "fails, swings or chatters", "ranked": "has a place"}
        kinds = [f"{words.get(fate, fate)} in {times}" for fate, times in Counter(fates).items()]
        begin, classes = ("", "") if sentences else ("printed gains: ", f" of {len(fates)} classes")
        sentences.append(f"{begin}{label.split('/')[0]} {', '.join(kinds)}{classes}")
    return sentences


def _papers_places(standings: Sequence[ClassStanding], names: dict[str, str]) -> list[str]:
    """The places of the paper's law in each class, of how many places."""
    sentences = []
    for label in names:
        law, _, gains = label.partition("/")
        if law != PAPERS or gains == PRINTED:
            continue
        places = []
        for standing in standings:
            group = standing.standing.group(standing.labels.index(label)) if label in standing.labels else None
            places.append("-" if group is None else f"{group}/{len(standing.standing.groups)}")
        sentences.append(f"{label} {', '.join(places)}")
    if not sentences:
        return []
    return [f"place of all places, by class (-: none): {sentences[0]}", *sentences[1:]]


def _papers_order(standings: Sequence[ClassStanding]) -> list[str]:
    """Whether the order of the paper's five laws by RMSE is that of their best rows here."""
    from wristctl.comparison.paper import T2

    printed = sorted(T2, key=lambda name: T2[name].rmse)
    rows = {
        standing.name: [standing.labels[row].split("/")[0] for row in standing.standing.order] for standing in standings
    }
    printed_laws = {name: list(dict.fromkeys(law for law in laws if law in T2)) for name, laws in rows.items()}
    ours = {name: laws for name, laws in printed_laws.items() if len(laws) == len(T2)}
    if not ours:
        return []
    holds = [name for name, order in ours.items() if order == printed]
    where = f" ({', '.join(holds)})" if holds else ""
    order = f"the paper's order (least RMSE first: {', '.join(printed)})"
    return [f"{order} holds in {len(holds)} of {len(ours)} classes{where}"]


def wrapped(pieces: Iterable[str], lines: int, columns: int = COLUMNS, remainder: str = "more") -> list[str]:
    """Wrap as many pieces as fit in `lines` lines, and add the number of the pieces left out."""
    texts = [piece for piece in pieces if piece]
    for kept in range(len(texts), 0, -1):
        text = "".join(
            f"{piece} " if piece.endswith(",") or after.startswith(_EQUAL) else f"{piece}; "
            for piece, after in zip(texts[:kept], [*texts[1:kept], ""], strict=True)
        ).rstrip(" ,;")
        text += f"; +{len(texts) - kept} {remainder}" if kept < len(texts) else ""
        wrapped_lines = in_lines(text, columns)
        if len(wrapped_lines) <= lines:
            break
    else:
        wrapped_lines = in_lines(texts[0] if texts else "", columns, max(1, lines))
    return [line.replace(_HELD, " ") for line in wrapped_lines]


def deg(value: float) -> str:
    """An angle [rad] in degrees, to two digits."""
    return two(math.degrees(value))


# Metrics that a motion which never rests does not have.
_OF_REST = ("settling", "overshoot")
# Metrics in the order of the printed table's columns; others that have a heading follow.
_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")

# Units of the columns of the table of standings.
STANDING_UNITS = dict.fromkeys(("rmse", "rmse_low", "rmse_high", "swing"), "rad") | {"peak": "N"}


def units() -> dict[str, str]:
    """Units of the columns of the comparison table, by name."""
    from wristctl.simulation.metrics import METRICS

    metric_units = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in metric_units.items() for end in ("low", "high")}
    return metric_units | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


def loop_tables(loop: str, results: list[ComparedRow], cells: Container[tuple[str, str]]) -> list[Table]:
    """A table for each reference on one loop; of repetitions medians, with the interval of the RMSE's.

    The paper's numbers stand in those of the `cells` (loop, reference) alone; a motion that never rests has neither
    settling time nor overshoot.
    """
    from wristctl.simulation.metrics import METRICS
    from wristctl.simulation.trajectory import rests

    shown = {name: METRICS[name].heading for name in dict.fromkeys((*_FIRST, *METRICS)) if METRICS[name].heading}
    times = max(len(result.repeated.failed) for result in results)
    ends = ("RMSE's 95 % low", "high") if times > 1 else ()
    tables = []
    for reference in dict.fromkeys(result.reference for result in results):
        on_reference, theirs = [row for row in results if row.reference == reference], (loop, reference) in cells
        columns = [name for name in shown if rests(on_reference[0].simulation.trajectory) or name not in _OF_REST]
        rows = [_row(result, columns, bool(ends), theirs) for result in on_reference]
        papers = ("paper's", "verdict") if theirs else ()
        heads = ("controller", "inverse", *(shown[name] for name in columns), *ends, *papers, "fate")
        medians = f", medians of {times} repetitions" if ends else ""
        tables.append(Table(f"Loop {loop}, {reference}{medians}", heads, rows))
    return tables


def _row(result: ComparedRow, shown: Iterable[str], repeated: bool, theirs: bool) -> tuple[str | float, ...]:
    from wristctl.commands.compare.csv_data import metrics_of
    from wristctl.comparison.repetition_spread import spread

    metrics = metrics_of(result)
    never = "failed" if result.repeated.failed.any() else "never"
    settling = metrics["settling"] if metrics["settling"] == metrics["settling"] else never
    values = [settling if name == "settling" else metrics[name] for name in shown]
    ends = spread(result.repeated.metrics["rmse"])[1:3] if repeated else ()
    papers = _paper(result) if theirs else ()
    return (result.label, result.inverse, *values, *ends, *papers, result.repeated.fate)


def step_table(times: dict[str, StepTime]) -> Table:
    """Table of the time of a control step on this machine [us]."""
    rows = [(label, time.median, time.p99) for label, time in times.items()]
    return Table("Control step of one wrist on this machine", ("controller", "median [us]", "p99 [us]"), rows)


def _paper(result: ComparedRow) -> tuple[str, str]:
    from wristctl.commands.compare.csv_data import metrics_of
    from wristctl.comparison.paper import T2, verdict

    if result.controller not in T2:
        return "", ""
    metrics = metrics_of(result)
    printed = " / ".join(f"{value:g}" for value in T2[result.controller])
    return printed, verdict(result.controller, metrics["rmse"], metrics["settling"], metrics["steady_state"])
