"""Keys and names that studies had once: those of today in their place, and a note of what they are called now."""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from wristctl.config import former_names
from wristctl.config.choices import CONTROLLERS
from wristctl.config.loop import LOOPS
from wristctl.errors import Phrase, worded
from wristctl.study_files.strict_yaml import Document, KeyPath

log = logging.getLogger(__name__)

# The end of a key path that is no setting any more, and what has come in its place.
REMOVED = {
    ("sensor", "seed"): "a camera's noise now comes from `seed`, the root of every random stream (--seed)",
    ("claims", "exact"): "each loop has a verdict of its own now, and `sense` says how a value is meant",
}


@dataclass
class NewNames:
    """Former names of a study, as they are met: what each is called now, and where the first stands."""

    names: dict[str, str] = field(default_factory=dict)
    place: Phrase = ""

    def add(self, former: str, today: str, place: Phrase) -> None:
        """Note a former name."""
        self.place = self.place if self.names else place
        self.names.setdefault(former, today)

    def note(self) -> None:
        """One note of all of them; none where there are none."""
        if self.names:
            where = f"{worded(self.place)}: " if self.place else ""
            told = "; ".join(f"{former} is now {today}" for former, today in self.names.items())
            log.warning("%sformer names are read: %s", where, told)


def with_keys_of_today(document: Document, place: Phrase, found: NewNames) -> Document:
    """The document with every key by its name of today."""
    data, lines = document.data, {former_names.key_today(path): line for path, line in document.lines.items()}
    if not isinstance(data, dict):
        return document
    renamed = former_names.KEYS
    if isinstance(log := _at(data, former_names.MEASURED), str):
        data = _with(_with(data, former_names.MEASURED, (log,)), ("identify", "model"), "hysteresis")
        renamed = renamed | former_names.WITH_MEASURED
    for before, today in renamed.items():
        value = _at(data, before)
        if value is None or _at(data, today) is not None:
            continue
        data = _with(_without(data, before), today, value)
        line = lines.get(today)
        found.add(".".join(before), ".".join(today), f"{worded(place)}:{line}" if line else place)
    return Document(data, lines)


def _at(data: Any, path: KeyPath) -> Any:
    """What a document has at a key path; None of nothing."""
    for key in path:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _with(data: Any, path: KeyPath, value: Any) -> Any:
    """A copy of the document with a value at a key path."""
    if not path:
        return value
    held = data if isinstance(data, dict) else {}
    return {**held, path[0]: _with(held.get(path[0]), path[1:], value)}


def _without(data: dict[Any, Any], path: KeyPath) -> dict[Any, Any]:
    """A copy of the document without a key path that it has."""
    kept = {key: value for key, value in data.items() if key != path[0]}
    return kept if len(path) == 1 else {**data, path[0]: _without(data[path[0]], path[1:])}


def with_loops_of_today(data: dict[str, Any], origins: dict[KeyPath, Phrase], found: NewNames) -> None:
    """Let the built-in loops of a study, and what its scenarios name, have their names of today.

    A loop of the study's own, which says more than that it is the built-in one, keeps its name.
    """
    compared = data.get("compare")
    tuning = compared.get("tuning") if isinstance(compared, dict) else None
    sections = {("tune",): data.get("tune"), ("compare",): compared, ("compare", "tuning"): tuning}
    for path, section in sections.items():
        if isinstance(section, dict):
            for former, today in former_names.LOOPS.items():
                _rename_loop(section, path, (former, today), origins, found)


def _rename_loop(
    section: dict[str, Any], path: KeyPath, names: tuple[str, str], origins: dict[KeyPath, Phrase], found: NewNames
) -> None:
    former, today = names
    loops, scenarios = section.get("loops", LOOPS), section.get("scenarios")
    tuned = "loops" in section and path[-1] != "compare" and not scenarios
    if isinstance(loops, dict) and former in loops and today not in loops and (tuned or loops[former] == {}):
        loops = section["loops"] = {today if name == former else name: loop for name, loop in loops.items()}
        for place in [key for key in origins if key[: len(path) + 2] == (*path, "loops", former)]:
            origins[(*path, "loops", today, *place[len(path) + 2 :])] = origins.pop(place)
        found.add(f"loop {former}", today, _place(origins, (*path, "loops", today)))
    if not isinstance(scenarios, tuple) or not isinstance(loops, Mapping):
        return
    for number, scenario in enumerate(scenarios):
        if not isinstance(scenario, dict):
            continue
        if scenario.get("loop") == former and former not in loops:
            scenario["loop"] = today
            found.add(f"loop {former}", today, _place(origins, (*path, "scenarios", number, "loop")))
        elif "loop" not in scenario and former in loops and today not in loops:
            scenario["loop"] = former


def note_presets(data: Any, origins: Mapping[KeyPath, Phrase], found: NewNames) -> None:
    """Note former names of the presets of built-in controllers. They stay, since a run's tables have them."""
    for path, node in _groups(data, ()):
        preset, name = node.get("gains"), node.get("controller", "smc")
        if isinstance(preset, str) and preset in former_names.PRESETS and name in list(CONTROLLERS):
            today = former_names.PRESETS[preset]
            found.add(f"preset {preset}", today, _place(origins, (*path, "gains")))


def leave_out_removed(data: dict[str, Any], origins: Mapping[KeyPath, Phrase]) -> None:
    """Take out keys that are no settings any more; a warning names each kind once, with its first place."""
    removed: dict[tuple[str, str], KeyPath] = {}
    for path, node in list(_groups(data, ())):
        section = next((part for part in reversed(path) if isinstance(part, str)), "")
        for key in [key for key in node if (section, str(key)) in REMOVED]:
            del node[key]
            removed.setdefault((section, str(key)), (*path, key))
    for former, path in removed.items():
        where = f"{worded(origins[path])}: " if path in origins else ""
        log.warning("%s%s is no longer a setting: %s", where, ".".join(map(str, path)), REMOVED[former])


def _place(origins: Mapping[KeyPath, Phrase], path: KeyPath) -> Phrase:
    """Where a key stands, or else the nearest group around it that has a place."""
    return next((origins[path[:end]] for end in range(len(path), 0, -1) if path[:end] in origins), "")


def _groups(node: Any, path: KeyPath) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Every group of keys of a study, with its key path."""
    if isinstance(node, dict):
        yield path, node
        for key, value in node.items():
            yield from _groups(value, (*path, key))
    elif isinstance(node, list | tuple):
        for position, item in enumerate(node):
            yield from _groups(item, (*path, position))
