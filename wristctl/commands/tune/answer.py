"""The answer of a search in words: gains with units, their error beside feedforward, and what they do wrong."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.answer import Answer
from wristctl.commands.kept_studies import FOLDER, file_of
from wristctl.commands.printed_table import Table, degrees, joined, two
from wristctl.commands.quantities import Quantity, table_of
from wristctl.commands.ranking_answer import gains_words
from wristctl.comparison.bootstrap import MEASURABLE
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.cases import Case, measure
from wristctl.tuning.margin import Stood
from wristctl.tuning.objective import YARDSTICK, marks_of
from wristctl.tuning.search import SEARCHED, Search, first_tried

# Share of a gain's search range, on its logarithmic scale, within which a gain lies at the edge.
_EDGE = 0.01
# Relative difference up to which two gains are the same.
_DIGITS = 1e-4
# What a mark says of a case, as a verb.
_VERBS = {
    "failed": "fails",
    "stops short": "stops short",
    "limit cycle": "swings",
    "chatters": "chatters",
    "not converged": "depends on the integration step",
}

# Difference of two errors' ratio from 1 that counts as none, and the same in decades, of two objectives.
_SAME = 0.01
# The same up to which it is told without its size.
_HARDLY = 0.05
_TIE = math.log10(1.0 + _SAME)


class Motion(NamedTuple):
    """What gains were searched on, as far as one motion shows it: the first of its loops and references."""

    name: str
    """Name of the loop, or of the family of worlds."""
    loops: Mapping[str, Loop]
    reference: Reference
    horizon: float
    """[s]"""
    where: str
    """The loop in words."""
    on_a_rig: bool
    """Whether `hw-run` can have the loop's rig."""
    network: str
    """Path of the run behind a reference through a network; empty without one."""


class Start(NamedTuple):
    """The best of a controller's presets, where a search found other gains that are better by its objective."""

    preset: str
    beside: Beside
    lost: Mapping[str, int]
    """What it does wrong, and in how many cases, by mark."""
    began: bool = False
    """Whether the search began with it."""


class Beside(NamedTuple):
    """RMSE of gains and of feedforward on the same cases, [rad]: the geometric mean of those where both last."""

    error: float
    feedforward: float
    cases: int
    """Cases where both last; 0: no error can be told."""

    @property
    def ratio(self) -> float:
        """How many times less the error is than feedforward's."""
        return self.feedforward / self.error


def beside_feedforward(
    gains: Mapping[str, Mapping[str, float]], cases: Sequence[Case], wrist: WristParameters
) -> dict[str, Beside]:
    """Error of each controller's gains beside feedforward; errors too small to be measured count alike."""

    def errors(name: str, values: Mapping[str, float]) -> Array:
        law = controller(name)
        measured = measure(law, np.array([law.values(values)]), cases, wrist, ["rmse"])
        return np.maximum(np.where(measured.failed[0], np.nan, measured.metrics["rmse"][0]), MEASURABLE)

    open_loop, results = errors(YARDSTICK, {}), {}
    for name, values in gains.items():
        closed = errors(name, values)
        both = np.isfinite(closed) & np.isfinite(open_loop)
        means = [float(np.exp(np.log(some[both]).mean())) if both.any() else math.nan for some in (closed, open_loop)]
        results[name] = Beside(means[0], means[1], int(both.sum()))
    return results


def starts_of(searches: Mapping[str, Search], cases: Sequence[Case], wrist: WristParameters) -> dict[str, Start]:
    """The best preset of each controller for which a search found better gains, on the cases these were chosen by."""
    presets = {name: search.best_preset for name, search in searches.items() if not _preset_of(search)}
    found = {name: preset for name, preset in presets.items() if preset is not None}
    gains = {name: dict(zip(controller(name).gains, preset.gains, strict=True)) for name, preset in found.items()}
    errors = beside_feedforward(gains, cases, wrist)
    lost = {name: marks_of(controller(name), np.array(preset.gains), cases, wrist) for name, preset in found.items()}
    return {
        name: Start(preset.origin, errors[name], lost[name], preset.origin == first_tried(controller(name)))
        for name, preset in found.items()
    }


def answer_of(
    searches: Mapping[str, Search],
    errors: Mapping[str, Beside],
    lost: Mapping[str, Mapping[str, int]],
    cases: int,
    run: str,
    elsewhere: Mapping[str, Mapping[str, Mapping[str, int]]],
    motion: Motion | None = None,
    stood: Mapping[str, Stood] | None = None,
    bending: str = "",
    starts: Mapping[str, Start] | None = None,
    conditions: Mapping[str, str] | None = None,
) -> Answer | None:
    """The answer of a search on so many `cases`; None where nothing was searched. `run` is its path, if it has one.

    `elsewhere` has the marks of the gains on other loops, by controller and loop; `motion` is the one to try them on,
    and `stood` how much they stand on its loop, by controller. `bending` says in which planes all loops bend, where
    these are two, and `starts` what the best preset of each controller is worth, of those for which a search found
    better gains; `conditions` are what `compare` calls the condition of each loop.
    """
    if not searches:
        return None
    ordered = sorted(searches, key=lambda name: searches[name].objective)
    sound = [name for name in ordered if _is_sound(errors[name], lost[name])]
    best = (sound or ordered)[0]
    little = [name for name in ordered if name in (stood or {}) and not (stood or {})[name].enough]
    sentence = " ".join([
        _verdict(searches[best], errors[best], lost[best], cases, best in little),
        *_error(errors[best], cases, (starts or {}).get(best)),
        *_ties(best, sound, searches),
        *_passed_over(ordered[0], best, errors, lost, cases),
    ])  # fmt: skip
    others = [name for name in ordered if name != best]
    notes = [bending] * bool(bending)
    notes.append(" ".join([_edges(ordered, searches), *_presets(others, searches), _lost(ordered, lost, cases)]))
    notes += _margins(ordered, stood or {}, little, motion.where if motion else "the loop")
    notes += _elsewhere(ordered, elsewhere, conditions or {})
    more = "All tables: `.tables`."
    if run and motion is not None:
        notes += _next(f"{run}/{file_of(best)}", motion)
        takers = "simulate, compare and hw-run" if motion.on_a_rig else "simulate and compare"
        more = f"All tables: --all. The gains, each a file for {takers}: {run}/{FOLDER}/"
    columns = ("controller", "objective", "error", "feedforward", "gains")
    answers = [
        Answer(sentence, searches_table(searches, errors, lost, cases, columns=shown), notes, more)
        for shown in (columns, columns[:-1])
    ]
    return answers[0] if answers[0].fits or len(ordered) == 1 else answers[1]


def _is_sound(beside: Beside, lost: Mapping[str, int]) -> bool:
    """Whether gains do nothing wrong in any case, and are better than feedforward."""
    return bool(beside.cases) and not lost and beside.ratio > 1.0 + _SAME


def _verdict(search: Search, beside: Beside, lost: Mapping[str, int], cases: int, little_margin: bool) -> str:
    """What to do with the best gains: to use them only where they hold and the search has come to an end of its own."""
    gains = f"{search.controller} with {gains_words(search.controller, search.gains)}"
    if not beside.cases:
        return (
            f"Nothing to use was found: {gains}. It fails in each of {cases} cases (objective {search.objective:.3g})."
        )
    if lost:
        return f"Nothing that holds was found: the best, {gains}, {_faults(lost, cases)}."
    if beside.ratio <= 1.0 + _SAME:
        as_good = "better than" if beside.ratio < 1.0 - _SAME else "as good as"
        return f"Feedforward alone is {as_good} what was found, {gains}."
    if edges := [gain for gain, *_ in at_edge(search)]:
        lie = f"{joined(edges)} {'lie' if len(edges) > 1 else 'lies'} at the edge of the box that was searched"
        return f"No optimum was found: the best is {gains}, and {lie}."
    if little_margin:
        return f"The best that was found has little margin: {gains}."
    if preset := _preset_of(search):
        return f"Keep the preset {preset} of {gains}: nothing better was found."
    return f"Use {gains}."


def _faults(lost: Mapping[str, int], cases: int) -> str:
    return " and ".join(f"{_VERBS[mark]} in {count} of {cases} cases" for mark, count in lost.items())


def _error(beside: Beside, cases: int, start: Start | None) -> list[str]:
    """Error of the best gains beside feedforward's and the best preset's; nothing where they fail everywhere."""
    if not beside.cases:
        return []
    times = f"{_times(beside.ratio)} feedforward's {degrees(beside.feedforward)} deg"
    if start is not None and (start.lost or not start.beside.cases):
        faults = _faults(start.lost, cases) if start.lost else "fails in each case"
        times += f"; its best preset, {_named(start)}, {faults}"
    elif start is not None:
        ratio = start.beside.error / beside.error
        times += f", {_times(ratio)} that of its best preset, {_named(start)}, {degrees(start.beside.error)} deg"
    where = f"{cases} cases" if beside.cases == cases else f"{beside.cases} of {cases} cases (in the others it fails)"
    return [f"Its error is {degrees(beside.error)} deg RMSE over {where}: {times}."]


def _named(start: Start) -> str:
    return f"{start.preset}, with which the search began" if start.began else start.preset


def _ties(best: str, sound: Sequence[str], searches: Mapping[str, Search]) -> list[str]:
    """Other controllers whose gains are as good: their objective is the same within 1 %."""
    least = searches[best].objective
    alike = [name for name in sound if name != best and searches[name].objective - least < _TIE]
    return [f"{joined(alike)} {'tie' if len(alike) > 1 else 'ties'} with it: equal within 1 %."] * bool(alike)


def _passed_over(
    first: str, best: str, errors: Mapping[str, Beside], lost: Mapping[str, Mapping[str, int]], cases: int
) -> list[str]:
    """Why the least objective is not the best controller's."""
    if first == best:
        return []
    why = _faults(lost[first], cases) if lost[first] else "is no better than feedforward"
    return [f"{first} has the least objective, but {why if errors[first].cases else 'fails in each case'}."]


def _preset_of(search: Search) -> str:
    """The preset that nothing better was found than, also where the search came upon it; empty where something was."""
    if not search.finalists:
        return ""
    if search.finalists[0].origin != SEARCHED:
        return search.finalists[0].origin

    def same(gains: Mapping[str, float]) -> bool:
        return all(math.isclose(value, gains[name], rel_tol=_DIGITS) for name, value in search.gains.items())

    return next((name for name, gains in controller(search.controller).presets.items() if same(gains)), "")


def _next(file: str, motion: Motion) -> list[str]:
    """Commands that try the gains of a file on what they were searched on."""
    network = ["--network", motion.network] if motion.network else []
    words = f"Next, one motion on {motion.where}, for which they were tuned"
    commands = [["wristctl", "simulate", file, *network]]
    if motion.on_a_rig:
        words += ", and trials of them on the emulated rig, to be done before any on a real one"
        commands += [["wristctl", "hw-run", file, *network]]
    return [f"{words}:", *(f"$ {shlex.join(command)}" for command in commands)]


def _times(ratio: float) -> str:
    """How an error is beside another one that is `ratio` times as large."""
    if abs(ratio - 1.0) < _SAME:
        return "the same as"
    if abs(ratio - 1.0) < _HARDLY:
        return f"hardly {'less' if ratio > 1.0 else 'more'} than"
    return f"{two(ratio)} times less than" if ratio > 1.0 else f"{two(1.0 / ratio)} times"


_TUNED = {
    quantity.name: quantity
    for quantity in (
        Quantity("controller"),
        Quantity("objective", meaning="decades beside feedforward", better="lower"),
        Quantity("error", "rad", better="lower"),
        Quantity("feedforward", "rad", heading="feedforward's"),
        Quantity("fate"),
        Quantity("origin", heading="found by"),
        Quantity("evaluations"),
        Quantity("gains"),
    )
}


def searches_table(
    searches: Mapping[str, Search],
    errors: Mapping[str, Beside],
    lost: Mapping[str, Mapping[str, int]],
    cases: int,
    title: str = "",
    columns: Sequence[str] = tuple(_TUNED),
) -> Table:
    """A row for each controller, best objective first; all columns, or some by name."""
    records = [
        {
            "controller": name,
            "objective": search.objective,
            "error": errors[name].error if errors[name].cases else None,
            "feedforward": errors[name].feedforward if errors[name].cases else None,
            "fate": ", ".join(f"{mark} in {count} of {cases} cases" for mark, count in lost[name].items()),
            "origin": search.finalists[0].origin if search.finalists else "search",
            "evaluations": search.evaluations,
            "gains": gains_words(name, search.gains),
        }
        for name, search in sorted(searches.items(), key=lambda named_search: named_search[1].objective)
    ]
    return table_of(title, [_TUNED[name] for name in columns], records)


def _edges(ordered: Sequence[str], searches: Mapping[str, Search]) -> str:
    """Gains that lie at an end of the range in which they were searched: beyond it may be better ones."""
    lines = [
        f"{gain} = {value:.4g} of {name} is at the edge of its box ({low:g} to {high:g} {unit}".rstrip() + ")."
        for name in ordered
        for gain, value, low, high, unit in at_edge(searches[name])
    ]
    return " ".join(lines) or "No gain lies at the edge of the box that was searched."


def at_edge(search: Search) -> list[tuple[str, float, float, float, str]]:
    """Gains within 1 % of an end of their search box, by its logarithmic scale: name, value, ends, unit."""
    table = controller(search.controller).gains
    near = []
    for name, value in search.gains.items():
        low, high, unit = table[name].low, table[name].high, table[name].unit
        place = math.log(value / low) / math.log(high / low)
        if min(place, 1.0 - place) <= _EDGE:
            near.append((name, value, low, high, unit))
    return near


def _presets(ordered: Sequence[str], searches: Mapping[str, Search]) -> list[str]:
    """Controllers for which the search found nothing better than a preset."""
    presets = {name: preset for name in ordered if (preset := _preset_of(searches[name]))}
    return [f"For {name} nothing better than the preset {preset} was found." for name, preset in presets.items()]


def _lost(ordered: Sequence[str], lost: Mapping[str, Mapping[str, int]], cases: int) -> str:
    """What the gains do wrong, and in how many cases; a sentence also where they do nothing wrong."""
    facts = [f"{name} {_faults(lost[name], cases)}" for name in ordered if lost[name]]
    if facts:
        return f"Do not rely on these: {'; '.join(facts)}."
    return f"In none of the {cases} cases does any of them fail, swing or chatter."


# Controllers whose margins are told one by one.
_FIRST = 3


def _margins(ordered: Sequence[str], stood: Mapping[str, Stood], little: Sequence[str], where: str) -> list[str]:
    """How much the best gains stand on the loop they were tuned for, and which stand less than they should."""
    told = [f"{name} {stood[name].words}" for name in ordered[:_FIRST] if name in stood]
    if not told:
        return []
    words = f"Margin on {where}, one change at a time without a swing or failure: {'; '.join(told)}."
    least = "torque x 0.67 to x 1.5, springs x 0.6 to x 1.4, 1 frame later"
    return [words + f" Less than {least}: {joined(little)}." * bool(little)]


def _elsewhere(
    ordered: Sequence[str],
    elsewhere: Mapping[str, Mapping[str, Mapping[str, int]]],
    conditions: Mapping[str, str],
) -> list[str]:
    """Loops beyond those of the search on which gains hold, and what they do on the others; with their `conditions`."""
    facts = []
    for name in ordered:
        does: dict[str, list[str]] = {"holds": []}
        for loop, wrong in elsewhere.get(name, {}).items():
            verbs, there = " and ".join(_VERBS[mark] for mark in wrong), conditions.get(loop, loop)
            does.setdefault(verbs or "holds", []).append(loop if there == loop else f"{loop} ({there})")
        words = [f"{verbs} on {joined(loops)}" for verbs, loops in does.items() if loops]
        facts += [f"{name} {', '.join(words)}"] * bool(words)
    unsound = any(wrong for marks in elsewhere.values() for wrong in marks.values())
    warned = " Do not use gains on a loop where they swing, stop short or fail." * unsound
    return [f"The same motions on the study's other loops: {'; '.join(facts)}.{warned}"] * bool(facts)
