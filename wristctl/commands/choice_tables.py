"""What can be chosen, a line each, from the tables of choices: controllers, presets, references and more."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from wristctl.commands.printed_table import Table
from wristctl.config.choices import CONTROLLERS, METRICS, REFERENCES, Choices
from wristctl.config.compare import CompareSettings
from wristctl.config.wrist import WristParameters


def _entries(table: Choices[Any]) -> dict[str, Any]:
    """Every entry of a table by name, those of installed packages too."""
    return {name: table[name] for name in table.known()}


def first_sentence(text: str) -> str:
    """The first sentence of a text, without its full stop; a full stop within brackets ends none."""
    line, depth = " ".join(text.split()), 0
    for place, letter in enumerate(line):
        depth += (letter in "([") - (letter in ")]")
        if depth == 0 and line.startswith(". ", place):
            return line[:place]
    return line.removesuffix(".")


def controllers() -> Table:
    """Every controller, the names of its presets, and what it is."""
    rows = []
    for name, law in _entries(CONTROLLERS).items():
        about = (sys.modules[law.law.__module__].__doc__ or "").split("\n\n")[0]
        rows.append((name, ", ".join(law.presets), first_sentence(about)))
    return Table("", ("controller", "presets", "what it is"), rows)


def presets() -> Table:
    """Every preset as it is typed, with its gains in their units; after a controller's own those that are shipped."""
    from wristctl.commands.ranking_answer import gains_words
    from wristctl.control.shipped_gains import shipped_for

    rows = [
        (f"{name}/{preset}", gains_words(name, gains) or "no gains")
        for name, law in _entries(CONTROLLERS).items()
        for preset, gains in {**law.presets, **shipped_for(name)}.items()
    ]
    return Table("", ("preset", "gains"), rows)


def references() -> Table:
    """Every reference, the number of planes that it bends in, and what it is."""
    rows = [(name, kind.planes, kind.meaning) for name, kind in _entries(REFERENCES).items()]
    return Table("", ("reference", "planes", "what it is"), rows)


def conditions() -> Table:
    """Every condition that `compare` ranks under, what it is, and its loops where a study names none, with presets."""
    from wristctl.commands.ranking_answer import class_words
    from wristctl.comparison.combinations import CLASS_MEANINGS, class_of
    from wristctl.comparison.controller_ranking import Traits, traits_of

    wrist, loops, rows = WristParameters(), CompareSettings().loops, []
    for name, meaning in CLASS_MEANINGS.items():
        own = {loop: loops[loop] for loop in loops if class_of(loops[loop], wrist) == name}
        words = class_words(name, traits_of(list(own.values()), wrist) if own else Traits())
        preset = ", ".join(dict.fromkeys("default" if loop.is_exact else "hardware" for loop in own.values()))
        rows.append((words, meaning, ", ".join(own) or "-", preset or "-"))
    return Table("", ("condition", "what it is", "loops by default", "preset of a name alone"), rows)


def metrics() -> Table:
    """Every metric with its unit, and how it is computed; less is better of all."""
    rows = [(name, metric.unit or "1", metric.formula) for name, metric in _entries(METRICS).items()]
    return Table("", ("metric", "unit", "what it is"), rows)


TABLES: Mapping[str, Callable[[], Table]] = {
    table.__name__: table for table in (controllers, presets, references, conditions, metrics)
}
