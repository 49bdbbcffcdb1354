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


LINES = 32
"""What an answer may take of a terminal."""
LADDER = ("feedforward", "pd-ff", "pid-ff", "pid-dob", "smc-dob")
"""What each more of a law buys: a term is worth what it adds to the rung below."""
PAPERS, PRINTED = "smc", "printed"
"""The paper's own law, and the gains that it prints."""
_INDENT = "    "
_WIDTH = COLUMNS - len(_INDENT)
_EQUAL = "="
"""Before a row that is not told apart from the best of its place."""
_HELD = "\u00a0"
"""A blank at which no line ends."""
_WHERE = "every row and metric: --all prints them, the run's report.html sorts and filters them"


def answer_lines(found: Sequence[ClassStanding]) -> list[str]:
    """At most LINES lines of at most COLUMNS columns; empty where nothing was judged."""
    if not found:
        return []
    from wristctl.simulation.oscillation import LIMIT_CYCLE

    names, rest = _names(found), deg(LIMIT_CYCLE)
    head = [
        "RMSE [deg], geometric mean [95 % interval], best first; = not told apart from the best of its place;",
        f"no place: fails, limit-cycles (> {rest} deg at rest), chatters, is short, not physical; no n/m: in all",
    ]
    end = [*wrapped(_printed(found), 2), *wrapped(_papers_places(found, names), 2), *wrapped(_papers_order(found), 1)]
    end.append(_WHERE)
    room = LINES - len(head) - len(end)
    rooms = [max(1, room // len(found))] * len(found)
    for at in sorted(range(len(found)), key=lambda at: -len(wrapped(_lost(found[at], names), LINES, _WIDTH))):
        rooms[at] += sum(rooms) < room
    blocks = [_block(each, names, own) for each, own in zip(found, rooms, strict=True)]
    return [*head, *[line for block in blocks for line in block][:room], *end]


def head_with_the_best(findings: Findings, found: Sequence[ClassStanding]) -> None:
    """Let the run's page be headed by the error of the best row of each class."""
    names: list[str] = []
    for each in found:
        if each.standing.groups:
            best = each.standing.groups[0][0]
            mean, names = each.means[best], [*names, f"best_{each.name.replace(',', '').replace(' ', '_')}"]
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            meaning = f"RMSE of {each.labels[best]}, the best row there, over {each.cells}"
            findings.metric(names[-1], mean.value, "rad", "lower", each.scores.shape[1], interval, meaning)
    findings.headline(*names)


def _names(found: Sequence[ClassStanding]) -> dict[str, str]:
    """What each row is called: by its law alone where that has no other row, and by printed gains always."""
    labels = dict.fromkeys(label for each in found for label in each.labels)
    laws = Counter(label.split("/")[0] for label in labels)
    alone = {label for label in labels if laws[label.split("/")[0]] == 1 and not label.endswith(f"/{PRINTED}")}
    return {label: label.split("/")[0] if label in alone else label.removesuffix("/default") for label in labels}


def _block(each: ClassStanding, names: dict[str, str], room: int) -> list[str]:
    """Groups in order, who has no place (of both as much as there is room for), and what the best one buys."""
    name = f"{each.name} ({each.cells}): "
    groups, lost, bought = _groups(each, names), _lost(each, names), _buys(each, names)
    below = (room - 1 if room < 3 else room - 2) if room > 1 else 0
    lines = wrapped(lost, below, _WIDTH) if below else []
    ends = wrapped(bought, 1, _WIDTH) if len(lines) < room - 1 else []
    lines = [*wrapped([name + groups[0], *groups[1:]], room - len(lines) - len(ends), _WIDTH), *lines, *ends]
    return [line if at == 0 else f"{_INDENT}{line}" for at, line in enumerate(lines)]


def _groups(each: ClassStanding, names: dict[str, str]) -> list[str]:
    """Each row as a piece: the first of a group with its number, those that are not told apart from it after =."""
    if untold := each.standing.untold:
        return _untold(each, [f"{names[each.labels[row]]} {degrees(each.means[row].value)}" for row in untold])
    if not each.standing.groups:
        return ["nothing has a place"]
    pieces = []
    for number, group in enumerate(each.standing.groups, start=1):
        for at, row in enumerate(group):
            mean = each.means[row]
            known = number == 1 and at == 0 and math.isfinite(mean.high) and mean.high > mean.low
            ends = f" [{degrees(mean.low)}, {degrees(mean.high)}]" if known else ""
            begin = f"{_EQUAL}{_HELD}" if at else f"{number}.{_HELD}"
            pieces.append(f"{begin}{names[each.labels[row]]} {degrees(mean.value)}{ends}")
    return pieces


def _untold(each: ClassStanding, rows: list[str]) -> list[str]:
    """That there are too few motions to tell these rows apart, least error first, and what would help."""
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    n, what = each.scores.shape[1], each.cells.split()[1].rstrip("s")
    more = "more motions or --repetitions" if each.loops else "more worlds"
    said = f"too few {what}s to tell (n={n}, {LEAST_PAIRS} at least): {more}; least error first, not ranked:"
    return [f"{said} {rows[0]},", *(f"{row}," for row in rows[1:])]


def _lost(each: ClassStanding, names: dict[str, str]) -> list[str]:
    """Who has no place: each row once, with in how many motions where not in all."""
    stands, motions = each.standing, each.motions
    called = [names[label] for label in each.labels]

    def among(times: int, count: int) -> str:
        return "" if times == count else f" {times}/{count}"

    unreliable: dict[str, list[str]] = {"fails": [], **{kind: [] for kind in each.unsound}}
    for row in stands.unreliable:
        sizes = {"limit cycle": f" +-{deg(each.swing[row])} deg", "chatters": f" {two(each.chatter[row])}/s"}
        n, times = stands.lost[row].n, {"fails": stands.failures[row].times}
        times |= {kind: int(counts[row]) for kind, counts in each.unsound.items()}
        first, *others = [kind for kind, count in times.items() if count]
        shown = {kind: f"{kind}{sizes.get(kind, '')}".removeprefix("limit cycle ") for kind in others}
        also = ", ".join(f"{what} in {times[kind]}/{n}" for kind, what in shown.items())
        told = f"{called[row]}{sizes.get(first, '')}{among(times[first], n)}"
        unreliable[first].append(told + f" ({also})" * bool(also))
    kinds = unreliable | {
        "does not arrive": [f"{called[row]}{among(int(each.away[row]), motions)}" for row in stands.short],
        "no tendon bears it": [f"{called[row]} {each.peak[row]:.2g} N" for row in stands.unphysical],
    }
    pieces = []
    for kind, rows in kinds.items():
        pieces += [f"{'' if at else f'{kind}: '}{row}{',' * (at < len(rows) - 1)}" for at, row in enumerate(rows)]
    return pieces


def _buys(each: ClassStanding, names: dict[str, str]) -> list[str]:
    """Errors of the next place, of feedforward and of the rungs of the ladder, over that of the best row."""
    groups = each.standing.groups
    if not groups:
        return []
    best = groups[0][0]
    rungs = {name: row for name in LADDER if (row := each.best(name)) is not None and row != best}
    following = [groups[1][0]] if len(groups) > 1 else []
    pieces: list[str] = []
    for row in dict.fromkeys([*following, *rungs.values()]):
        ratio, name = each.times_better(best, row), names[each.labels[row]]
        known = name == LADDER[0] and math.isfinite(ratio.high)
        times = f"{ratio.value:.2f}" if ratio.value < 10.0 else two(ratio.value)
        pieces.append(f"{name} x{times}" + f" [{two(ratio.low)}, {two(ratio.high)}]" * known + ",")
    least = degrees(each.means[best].value)
    beside = f"{names[each.labels[best]]}'s" if not least.startswith("<") else f"{least[1:]} deg"
    return [f"errors over {beside}: {pieces[0]}", *pieces[1:]] if pieces else []


def _printed(found: Sequence[ClassStanding]) -> list[str]:
    """What becomes of the gains that the paper prints: in how many classes which fate, which add up to all."""
    said: list[str] = []
    for label in dict.fromkeys(label for each in found for label in each.labels if label.endswith(f"/{PRINTED}")):
        own = [each.standing.fate(each.labels.index(label)) for each in found if label in each.labels]
        words = {"unreliable": "fails, swings or chatters", "ranked": "has a place"}
        kinds = [f"{words.get(fate, fate)} in {times}" for fate, times in Counter(own).items()]
        begin, classes = ("", "") if said else ("printed gains: ", f" of {len(own)} classes")
        said.append(f"{begin}{label.split('/')[0]} {', '.join(kinds)}{classes}")
    return said


def _papers_places(found: Sequence[ClassStanding], names: dict[str, str]) -> list[str]:
    """The places of the paper's law in each class, of how many places."""
    said = []
    for label in names:
        law, _, gains = label.partition("/")
        if law != PAPERS or gains == PRINTED:
            continue
        places = []
        for each in found:
            group = each.standing.group(each.labels.index(label)) if label in each.labels else None
            places.append("-" if group is None else f"{group}/{len(each.standing.groups)}")
        said.append(f"{label} {', '.join(places)}")
    if not said:
        return []
    return [f"place of all places, by class (-: none): {said[0]}", *said[1:]]


def _papers_order(found: Sequence[ClassStanding]) -> list[str]:
    """Whether the order of the paper's five laws by RMSE is that of their best rows here."""
    from wristctl.comparison.paper import T2

    printed = sorted(T2, key=lambda name: T2[name].rmse)
    rows = {each.name: [each.labels[row].split("/")[0] for row in each.standing.order] for each in found}
    known = {name: list(dict.fromkeys(law for law in laws if law in T2)) for name, laws in rows.items()}
    ours = {name: laws for name, laws in known.items() if len(laws) == len(T2)}
    if not ours:
        return []
    holds = [name for name, order in ours.items() if order == printed]
    where = f" ({', '.join(holds)})" if holds else ""
    order = f"the paper's order (least RMSE first: {', '.join(printed)})"
    return [f"{order} holds in {len(holds)} of {len(ours)} classes{where}"]


def wrapped(pieces: Iterable[str], lines: int, columns: int = COLUMNS, rest: str = "more") -> list[str]:
    """As many of the pieces as there is room for in lines, and how many more there are."""
    given = [piece for piece in pieces if piece]
    for kept in range(len(given), 0, -1):
        text = "".join(
            f"{each} " if each.endswith(",") or after.startswith(_EQUAL) else f"{each}; "
            for each, after in zip(given[:kept], [*given[1:kept], ""], strict=True)
        ).rstrip(" ,;")
        text += f"; +{len(given) - kept} {rest}" if kept < len(given) else ""
        found = in_lines(text, columns)
        if len(found) <= lines:
            break
    else:
        found = in_lines(given[0] if given else "", columns, max(1, lines))
    return [line.replace(_HELD, " ") for line in found]


def deg(value: float) -> str:
    """An angle [rad] in degrees, to two digits."""
    return two(math.degrees(value))


_OF_REST = ("settling", "overshoot")
"""Metrics that a motion which never rests does not have."""
_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")
"""Metrics in the order of the printed table's columns; others that have a heading follow."""

STANDING_UNITS = dict.fromkeys(("rmse", "rmse_low", "rmse_high", "swing"), "rad") | {"peak": "N"}
"""Of the columns of the table of standings."""


def units() -> dict[str, str]:
    """Of the columns of its table."""
    from wristctl.simulation.metrics import METRICS

    own = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in own.items() for end in ("low", "high")}
    return own | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


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
        own, theirs = [each for each in results if each.reference == reference], (loop, reference) in cells
        columns = [name for name in shown if rests(own[0].simulation.trajectory) or name not in _OF_REST]
        rows = [_row(result, columns, bool(ends), theirs) for result in own]
        papers = ("paper's", "verdict") if theirs else ()
        heads = ("controller", "inverse", *(shown[name] for name in columns), *ends, *papers, "fate")
        medians = f", medians of {times} repetitions" if ends else ""
        tables.append(Table(f"Loop {loop}, {reference}{medians}", heads, rows))
    return tables


def _row(result: ComparedRow, shown: Iterable[str], repeated: bool, theirs: bool) -> tuple[str | float, ...]:
    from wristctl.comparison.comparison_data import metrics_of
    from wristctl.comparison.statistics import spread

    metrics = metrics_of(result)
    never = "failed" if result.repeated.failed.any() else "never"
    settling = metrics["settling"] if metrics["settling"] == metrics["settling"] else never
    values = [settling if name == "settling" else metrics[name] for name in shown]
    ends = spread(result.repeated.metrics["rmse"])[1:3] if repeated else ()
    papers = _paper(result) if theirs else ()
    return (result.label, result.inverse, *values, *ends, *papers, result.repeated.fate)


def step_table(times: dict[str, StepTime]) -> Table:
    """What a control step costs here."""
    rows = [(label, time.median, time.p99) for label, time in times.items()]
    return Table("Control step of one wrist on this machine", ("controller", "median [us]", "p99 [us]"), rows)


def _paper(result: ComparedRow) -> tuple[str, str]:
    from wristctl.comparison.comparison_data import metrics_of
    from wristctl.comparison.paper import T2, verdict

    if result.controller not in T2:
        return "", ""
    metrics = metrics_of(result)
    printed = " / ".join(f"{value:g}" for value in T2[result.controller])
    return printed, verdict(result.controller, metrics["rmse"], metrics["settling"], metrics["steady_state"])
