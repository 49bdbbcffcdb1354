"""Files that a study names: looked for beside the study that names them, and sealed into the runs made of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pydantic import Field
from pydantic.config import JsonDict
from pydantic.fields import FieldInfo

from wristctl.config.section import Section
from wristctl.config.strict_yaml import KeyPath


def given_file(meaning: str, default: tuple[()] | None = None) -> Any:
    """A leaf that names a file, or several; config.yaml leaves it out where none is given."""
    extra: JsonDict = {"unit": "", "source": "", "file": True, "unsaid": True}
    return Field(default, description=meaning, json_schema_extra=extra)


def of_file(meaning: str) -> Any:
    """A leaf that says how a file is read; left out of config.yaml likewise."""
    return Field(None, description=meaning, json_schema_extra={"unit": "", "source": "", "unsaid": True})


def names_a_file(field: FieldInfo | None) -> bool:
    """Whether a leaf names files."""
    extra = field.json_schema_extra if field else None
    return isinstance(extra, dict) and bool(extra.get("file"))


def files_of(section: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, str]]:
    """Every file that is named in a section, at whatever depth, with its key path."""
    if isinstance(section, Section):
        for name, field in type(section).model_fields.items():
            value, at = getattr(section, name), (*path, field.alias or name)
            if names_a_file(field):
                yield from ((at, each) for each in ((value,) if isinstance(value, str) else value or ()))
            else:
                yield from files_of(value, at)
    elif isinstance(section, dict | tuple):
        entries = section.items() if isinstance(section, dict) else enumerate(section)
        for key, each in entries:
            yield from files_of(each, (*path, key))


def renamed(section: Any, name: Callable[[str], str]) -> Any:
    """The section with each file that it names under another name; the very same where it names none."""
    if isinstance(section, Section):
        changed = {}
        for leaf, field in type(section).model_fields.items():
            value = getattr(section, leaf)
            new = _named(value, name) if names_a_file(field) else renamed(value, name)
            if new is not value:
                changed[leaf] = new
        return section.model_copy(update=changed) if changed else section
    if isinstance(section, dict):
        entries = {key: renamed(each, name) for key, each in section.items()}
        return entries if any(entries[key] is not section[key] for key in entries) else section
    if isinstance(section, tuple):
        items = tuple(renamed(each, name) for each in section)
        return items if any(new is not old for new, old in zip(items, section, strict=True)) else section
    return section


def _named(value: str | tuple[str, ...] | None, name: Callable[[str], str]) -> str | tuple[str, ...] | None:
    if isinstance(value, str):
        return name(value)
    return tuple(map(name, value)) if value else value


def beside(folder: Path, value: Any) -> Any:
    """Names of files as they are meant in a study that stands in a folder; what is no name is left for the schema."""
    if isinstance(value, str) and value:
        return str((folder / Path(value).expanduser()).absolute())
    return tuple(beside(folder, each) for each in value) if isinstance(value, tuple) else value
