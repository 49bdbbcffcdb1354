"""The leaves of a study's sections, at whatever depth, and sections with other leaves."""

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, get_args

from pydantic.fields import FieldInfo

from wristctl.config.choices import CONTROLLERS, Choices
from wristctl.config.section import OneOf, Section


def with_leaves(value: Any, leaf: Callable[[FieldInfo, Any], Any]) -> Any:
    """A section, or a list or mapping of some, with `leaf(field, value)` in every field; itself where all are equal."""
    copy: Any
    if isinstance(value, Section):
        fields = {name: (getattr(value, name), field) for name, field in type(value).model_fields.items()}
        copy = {name: with_leaves(leaf(field, entry), leaf) for name, (entry, field) in fields.items()}
        changed = {name: entry for name, entry in copy.items() if entry is not fields[name][0]}
        return value.model_copy(update=changed) if changed else value
    if isinstance(value, dict):
        copy = {key: with_leaves(entry, leaf) for key, entry in value.items()}
    elif isinstance(value, tuple):
        copy = tuple(with_leaves(entry, leaf) for entry in value)
    else:
        return value
    return copy if copy != value else value


Rename = Callable[[Choices[Any], str], str]


def tables_of(annotation: Any, metadata: Sequence[Any] = ()) -> Iterator[Choices[Any]]:
    """The tables whose names a leaf may have, by itself or in a list."""
    for annotation_part in metadata:
        if isinstance(annotation_part, OneOf):
            yield annotation_part.table
    for part in get_args(annotation):
        yield from tables_of(part, getattr(part, "__metadata__", ()))


def renamed(section: Any, rename: Rename) -> Any:
    """A section (or a list or mapping of some) with `rename(table, name)` for every name of a table in it."""

    def leaf(field: FieldInfo, value: Any) -> Any:
        table = next(tables_of(field.annotation, field.metadata), None)
        if table is None or value is None:
            return value
        return tuple(rename(table, name) for name in value) if isinstance(value, tuple) else rename(table, value)

    return with_leaves(section, leaf)


def named_in(value: Any) -> list[tuple[Choices[Any], str]]:
    """Every name of a table that a section names, in order."""
    named: dict[tuple[int, str], tuple[Choices[Any], str]] = {}

    def note(table: Choices[Any], name: str) -> str:
        named.setdefault((id(table), name), (table, name))
        return name

    renamed(value, note)
    return list(named.values())


def renamed_in_sweep(sweep: Sequence[str], rename: Rename) -> tuple[str, ...]:
    """The axes of a sweep, KEY=VALUES, with `rename(table, name)` for every controller that one takes in turn."""

    def axis(text: str) -> str:
        key, _, values = text.partition("=")
        if key.strip().split(".")[-1] != "controller":
            return text
        names = [item.strip().strip("\"'") for item in values.split(",")]
        called = [rename(CONTROLLERS, name) for name in names]
        return text if called == names else f"{key}={','.join(called)}"

    return tuple(axis(text) for text in sweep)


def swept_controllers(sweep: Sequence[str]) -> list[str]:
    """The controllers that the axes of a sweep take in turn, each once, as they are named there."""
    names = dict[str, None]()

    def note(_: Choices[Any], name: str) -> str:
        names[name] = None
        return name

    renamed_in_sweep(sweep, note)
    return list(names)


def renamed_fields(study: Section, rename: Rename, fields: Collection[str] | None = None) -> dict[str, Any]:
    """Fields of a study with `rename(table, name)` for every name of a table in them, and in its sweep's values."""
    called = {name: renamed(value, rename) for name, value in study if fields is None or name in fields}
    return called | ({"sweep": renamed_in_sweep(called["sweep"], rename)} if "sweep" in called else {})


def named_by(study: Section, fields: Collection[str] | None = None) -> list[tuple[Choices[Any], str]]:
    """Every name of a table that fields of a study name, in order: those that its sweep takes in turn at the end."""
    named = named_in(tuple(value for name, value in study if fields is None or name in fields))
    known = {name for table, name in named if table is CONTROLLERS}
    swept = swept_controllers(getattr(study, "sweep", ())) if fields is None or "sweep" in fields else []
    return named + [(CONTROLLERS, name) for name in swept if name not in known and name in CONTROLLERS]
