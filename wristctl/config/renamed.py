"""A study with other names for entries of the tables of choices: those that its sections name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, get_args

from wristctl.config.choices import Choices
from wristctl.config.section import OneOf, Section

Rename = Callable[[Choices[Any], str], str]


def tables_of(annotation: Any, metadata: Sequence[Any] = ()) -> Iterator[Choices[Any]]:
    """The tables whose names a leaf may have, by itself or in a list."""
    for each in metadata:
        if isinstance(each, OneOf):
            yield each.table
    for part in get_args(annotation):
        yield from tables_of(part, getattr(part, "__metadata__", ()))


def renamed(value: Any, rename: Rename) -> Any:
    """A section (or a list or mapping of some) with `rename(table, name)` for every name of a table in it."""
    if isinstance(value, tuple):
        return tuple(renamed(each, rename) for each in value)
    if isinstance(value, dict):
        return {key: renamed(each, rename) for key, each in value.items()}
    if not isinstance(value, Section):
        return value
    update: dict[str, Any] = {}
    for name, field in type(value).model_fields.items():
        given, table = getattr(value, name), next(tables_of(field.annotation, field.metadata), None)
        if table is None:
            made = renamed(given, rename)
        elif isinstance(given, tuple):
            made = tuple(rename(table, each) for each in given)
        else:
            made = rename(table, given)
        if made != given:
            update[name] = made
    return value.model_copy(update=update) if update else value


def named_in(value: Any) -> list[tuple[Choices[Any], str]]:
    """Every name of a table that a section names, in order."""
    found: dict[tuple[int, str], tuple[Choices[Any], str]] = {}

    def note(table: Choices[Any], name: str) -> str:
        found.setdefault((id(table), name), (table, name))
        return name

    renamed(value, note)
    return list(found.values())
