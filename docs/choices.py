"""Make docs/choices.md anew, from the tables of choices and the schema of studies: `python docs/choices.py`."""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic_core import PydanticUndefined

from wristctl.config.choices import (
    CONTROLLERS,
    DISTURBANCES,
    LOG_FORMATS,
    METRICS,
    OPTIMISERS,
    PLANTS,
    PLANTS_IN_SPACE,
    REFERENCES,
    RIGS,
)
from wristctl.config.learning import PRESETS
from wristctl.config.loop import Loop, Reference
from wristctl.config.section import OneOf, Section
from wristctl.config.study import Study
from wristctl.study_files.keys import keys_of, source_of, unit_of

PAGE = Path(__file__).with_suffix(".md")
OPENING = """# What can be chosen

The configuration of a study. First what has a name: [controllers](#controllers), [references](#references),
[metrics](#metrics), [optimisers](#optimisers), [disturbances](#disturbances), [plants](#plants),
[rigs](#rigs), [log formats](#log-formats), [networks](#presets-of-networks); then
[every key](#every-key-of-a-study) with its default.
`wristctl COMMAND --dry-run --all` prints the keys of a study. A newcomer to a table is one file and one line:
[CONTRIBUTING](../CONTRIBUTING.md).

Made by `python docs/choices.py` from the tables in `wristctl/config/choices.py` and the schema of studies."""
HEAD = "key, default, unit, range, meaning, source"
BOUNDS = {"gt": "> {}", "ge": ">= {}", "lt": "< {}", "le": "<= {}"}
COUNTS = {"min_length": "at least {}", "max_length": "at most {}"}


def table(head: str, rows: Any) -> str:
    """Rows under a head of columns parted by commas; a bar in a cell is escaped."""
    lines = [head.split(", "), ["---"] * len(head.split(", ")), *rows]
    return "\n".join(f"| {' | '.join(str(each).replace('|', chr(92) + '|') for each in line)} |" for line in lines)


def about(module: str) -> str:
    """The first paragraph of a module's docstring, without its full stop."""
    return " ".join((sys.modules[module].__doc__ or "").split("\n\n")[0].split()).removesuffix(".")


def plants() -> Iterator[tuple[str, ...]]:
    """Every plant, and what it is in one plane and in two."""
    for name in {**PLANTS, **PLANTS_IN_SPACE}:
        both = (table.get(name) for table in (PLANTS, PLANTS_IN_SPACE))
        yield f"`{name}`", *(about(plant.values.__module__) if plant else "" for plant in both)


def shown(value: Any) -> str:
    """A value as YAML in one line; of a section what was set."""
    if isinstance(value, Section):
        names = {name: key for key, name in zip(keys_of(type(value)), type(value).model_fields, strict=True)}
        value = {names[name]: getattr(value, name) for name in names if name in value.model_fields_set}
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {shown(each)}' for key, each in value.items())}}}"
    if isinstance(value, tuple):
        return f"[{', '.join(map(shown, value))}]"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value:.12g}" if isinstance(value, float) else str(value) or '""'


def range_of(field: Any) -> str:
    """What a leaf may be: its bounds, and how many entries it has."""
    told = [_bounds_of(field.metadata), *_bounds_within(field.annotation)]
    return ", ".join(dict.fromkeys(part for part in told if part))


def _bounds_of(metadata: Any) -> str:
    told = [(name, getattr(each, name, None)) for each in metadata for name in BOUNDS | COUNTS]
    return ", ".join((BOUNDS | COUNTS)[name].format(f"{at:.12g}") for name, at in told if at is not None)


def _bounds_within(annotation: Any) -> Iterator[str]:
    """Bounds of the numbers that an annotation is made of: those of one of several kinds, or of each in a list."""
    for each in getattr(annotation, "__metadata__", ()):
        yield _bounds_of(getattr(each, "metadata", ()))
    of_each = "each " if get_origin(annotation) in (tuple, dict) else ""
    for part in get_args(annotation):
        yield from (f"{of_each}{within}" for within in _bounds_within(part) if within)


def sections_in(annotation: Any) -> Iterator[Any]:
    """Sections named by an annotation: itself, of a list, of a mapping, or of what may be null."""
    if keys_of(annotation):
        yield annotation
    for each in get_args(annotation):
        yield from sections_in(each)


def names_in(parts: Any) -> Iterator[str]:
    """The names that parts of an annotation allow: those of a table by its heading here, or each by itself."""
    for each in parts:
        if isinstance(each, OneOf):
            yield f"[{each.table.what}s](#{each.table.what}s)"
        elif get_origin(each) is Literal:
            yield from (f"`{name}`" for name in get_args(each))
        elif not keys_of(each):
            yield from names_in(get_args(each))


def mentions(kind: Any, seen: Counter[Any]) -> Counter[Any]:
    """How often each section is mentioned below this one; one of a list counts as several."""
    for field in keys_of(kind).values():
        for each in sections_in(field.annotation):
            new = each not in seen
            seen[each] += 1 if each is field.annotation else 2
            if new:
                mentions(each, seen)
    return seen


COMMANDS = {field.annotation: key for key, field in keys_of(Study).items() if keys_of(field.annotation)}
GROUPS = [kind for kind, count in mentions(Study, Counter()).items() if count > 1 and kind not in COMMANDS]


def link(kind: Any) -> str:
    """To a command's section, or to a group of keys that stands in several places."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", kind.__name__.removesuffix("Settings")).lower()
    return f"[{COMMANDS[kind]}](#{COMMANDS[kind]})" if kind in COMMANDS else f"[{name}](#group-{name})"


def leaves(kind: Any, given: Any = None, before: str = "") -> Iterator[tuple[str, ...]]:
    """Key, default, unit, range, meaning and source of each leaf; those of a group stand with the group."""
    for (key, field), name in zip(keys_of(kind).items(), kind.model_fields, strict=True):
        value, inner = getattr(given, name) if given else field.default, list(sections_in(field.annotation))
        if inner == [field.annotation] and inner[0] not in GROUPS:
            yield from leaves(inner[0], value, f"{before}{key}.")
            continue
        meaning, choices = field.description or "", [*names_in((field.annotation, *field.metadata)), *map(link, inner)]
        told = ", ".join(each for each in choices if each.strip("`") not in meaning)
        default = "required" if value is PydanticUndefined else f"`{shown(value)}`"
        source = source_of(field) if value == field.default else ""
        yield (
            f"`{before}{key}`",
            default,
            unit_of(field),
            range_of(field),
            ": ".join(filter(None, (meaning, told))),
            source,
        )


def section_tables(before: str, named: Mapping[Any, str]) -> str:
    """Of each section by its name: its first words and the table of its leaves."""
    first = {kind: (kind.__doc__ or "").split("\n\n")[0].replace("\n    ", " ") for kind in named}
    parts = (f"## {before}{name}\n\n{first[kind]}\n\n{table(HEAD, leaves(kind))}" for kind, name in named.items())
    return "\n\n".join(parts)


def added(entry: Any) -> str:
    """The keys that an entry of a table brings along."""
    return "; ".join(f"`{name}` {it.default:g} {it.unit}: {it.meaning}" for name, it in entry.parameters.items())


def page() -> str:
    """The whole page."""
    laws, optimisers = list(CONTROLLERS.values()), OPTIMISERS.items()
    gains = [(law, name, gain) for law in laws for name, gain in law.gains.items()]
    presets = [(f"`{law.name}`", name, law.notes.get(name, "")) for law in laws for name in law.presets]
    how = {name: ["force"] * bool(each.force) + ["stiffness"] * bool(each.scale) for name, each in DISTURBANCES.items()}
    return f"""{OPENING}

## Controllers

{table("name, what it is, source", ((f"`{each.name}`", about(each.law.__module__), each.source) for each in laws))}

Gains, as `gains: {{Kp: 1, ...}}`, or a preset by its name:

{table("controller, gain, unit, meaning, searched from, to, presets", (of_gain(*each) for each in gains))}

{table("controller, preset, what to know", presets)}

## References

{table("kind, what it is, keys of its own", ((f"`{k}`", v.meaning, added(v)) for k, v in REFERENCES.items()))}

What they share is in the group {link(Reference)}.

## Metrics

Less is better of all. Each may have a weight in `tune.objective`. A wrist that never settles has no settling time: nan.

{table("name, unit, heading, what it is, nan counts in tuning as", (of_metric(*each) for each in METRICS.items()))}

## Optimisers

{
        table(
            "name, what it is, least candidates",
            ((f"`{k}`", about(v.__module__), v.least_candidates) for k, v in optimisers),
        )
    }

## Disturbances

{
        table(
            "name, what it is, acts by, keys of its own",
            ((f"`{k}`", v.meaning, ", ".join(how[k]), added(v)) for k, v in DISTURBANCES.items()),
        )
    }

How large they are is in the group {link(Loop)}.

## Plants

{table("name, in one plane, in two planes", plants())}

## Rigs

Robots in place of the board with its cameras, of `hw-run --rig`. One of your own is a file:
[your own rig](your-own-rig.md).

{table("name, what it is", ((f"`{k}`", " ".join((v.__doc__ or "").split())) for k, v in RIGS.items()))}

## Log formats

Text of other programs, known by how it begins, or by its name in `--columns`: [the open log](open-log.md).

{table("name, what it is", ((f"`{k}`", v.what) for k, v in LOG_FORMATS.items()))}

## Presets of networks

{table("preset, what it sets", ((f"`{name}`", shown(given)) for name, given in PRESETS.items()))}

# Every key of a study

A section for each command; `seed` and `wrist` are for all of them. Source: where a default comes from.

{table(HEAD, (each for each in leaves(Study) if each[0] == "`seed`"))}

{section_tables("", COMMANDS)}

# Groups of keys

What stands in several places. Where a group is a default of its own, the table above says what differs.

{section_tables("Group ", {kind: link(kind)[1:].partition("]")[0] for kind in GROUPS})}
"""


def of_gain(law: Any, name: str, gain: Any) -> Sequence[str]:
    """A row of the table of gains."""
    presets = ", ".join(f"{preset} {given[name]:g}" for preset, given in law.presets.items())
    return f"`{law.name}`", f"`{name}`", gain.unit, gain.meaning, f"{gain.low:g}", f"{gain.high:g}", presets


def of_metric(name: str, metric: Any) -> Sequence[str]:
    """A row of the table of metrics."""
    never = "failed" if metric.never is None else f"{metric.never(1.0):g} horizon"
    return f"`{name}`", metric.unit, metric.heading or "data files only", metric.formula, never


if __name__ == "__main__":
    PAGE.write_text(page())
