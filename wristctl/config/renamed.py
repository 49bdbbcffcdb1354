"""A study with other names for entries of the tables of choices: those that its sections name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, get_args

from pydantic.fields import FieldInfo

from wristctl.config.choices import Choices
from wristctl.config.leaves import with_leaves
from wristctl.config.section import OneOf

Rename = Callable[[Choices[Any], str], str]


def tables_of(annotation: Any, metadata: Sequence[Any] = ()) -> Iterator[Choices[Any]]:
    """The tables whose names a leaf may have, by itself or in a list."""
    for each in metadata:
        if isinstance(each, OneOf):
            yield each.table
    for part in get_args(annotation):
        yield from tables_of(part, getattr(part, "__metadata__", ()))


def renamed(section: Any, rename: Rename) -> Any:
    """A section (or a list or mapping of some) with `rename(table, name)` for every name of a table in it."""

    def leaf(field: FieldInfo, value: Any) -> Any:
        table = next(tables_of(field.annotation, field.metadata), None)
        if table is None:
            return value
        return tuple(rename(table, each) for each in value) if isinstance(value, tuple) else rename(table, value)

    return with_leaves(section, leaf)


def named_in(value: Any) -> list[tuple[Choices[Any], str]]:
    """Every name of a table that a section names, in order."""
    found: dict[tuple[int, str], tuple[Choices[Any], str]] = {}

    def note(table: Choices[Any], name: str) -> str:
        found.setdefault((id(table), name), (table, name))
        return name

    renamed(value, note)
    return list(found.values())
