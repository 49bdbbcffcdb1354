"""Keys of a study file, with the field of each key."""

from collections.abc import Sequence
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from wristctl.config import former_names
from wristctl.config.controller_row import Row
from wristctl.config.section import OneOf, Section
from wristctl.config.study import Study
from wristctl.study_files.strict_yaml import KeyPath


def keys_of(kind: Any) -> dict[str, FieldInfo]:
    """The fields of a section by the keys they have in a file; empty where `kind` is no section."""
    if not (isinstance(kind, type) and issubclass(kind, Section)):
        return {}
    return {field.alias or name: field for name, field in kind.model_fields.items()}


def field_at(path: KeyPath) -> tuple[Any, FieldInfo | None]:
    """The annotation at a key path (None where the schema has none), and the last field passed on the way."""
    kind: Any = Study
    field: FieldInfo | None = None
    for key in path:
        if fields := keys_of(kind):
            field = fields.get(str(key))
            kind = _given(field.annotation) if field else None
        else:
            whole = get_args(kind)[-1] if get_origin(kind) in (Union, UnionType) else kind  # a name, or a list
            items = [item for item in get_args(whole) if item is not ...]
            kind = items[-1] if items else None
    return kind, field


def _given(annotation: Any) -> Any:
    """The annotation of a leaf that is given: `X | None` is X."""
    kinds = [kind for kind in get_args(annotation) if kind is not NoneType]
    return kinds[0] if isinstance(annotation, UnionType) and len(kinds) == 1 else annotation


# Commands that work on what a section of another name describes: its keys are theirs too.
SUBJECTS = {"analyse": "simulate", "validate": "real-robot"}
# Keys of a study that are no section of a command.
NO_COMMANDS = ("seed", "wrist", "families", "sweep", "controller-settings", "real-robot", "hysteresis")


def is_command(kind: str) -> bool:
    """Whether a command makes runs of this kind."""
    return kind in SUBJECTS or kind in keys_of(Study).keys() - {*NO_COMMANDS}


def command_of(kind: str) -> str:
    """The words that make a run of this kind: `hw calibrate camera`, `paper audit`, else the kind itself."""
    if kind == "audit":
        return "paper audit"
    return f"hw {kind.replace('-', ' ')}" if kind.startswith("calibrate-") else kind


# Sections with a list of controllers, for which one controller or gains may be given in short.
LISTS_OF_ROWS = {"hw-run": "controllers"}


def section_keys(command: str | None) -> dict[str, FieldInfo]:
    """The keys of a command's own section and of the one that it works on; empty where it has none."""
    sections = [SUBJECTS[command], command] if command in SUBJECTS else [command] if command else []
    short = keys_of(Row) if command in LISTS_OF_ROWS else {}
    return short | {key: field for section in sections for key, field in keys_of(field_at((section,))[0]).items()}


def home_of(command: str, key: str) -> str:
    """The section in which a command finds one of its keys."""
    return command if key in keys_of(field_at((command,))[0]) else SUBJECTS.get(command, command)


def whole_key(key: str, command: str | None) -> str:
    """A dotted key, or an override that begins with one, with the section in which a command looks for it."""
    first = key.partition("=")[0].partition(".")[0]
    if command and (first in section_keys(command) or (command, first) in former_names.KEYS):
        return f"{home_of(command, first)}.{key}"
    return key


def unit_of(field: FieldInfo) -> str:
    """The unit a leaf was declared with, empty where it has none."""
    return _declared(field, "unit")


def choices_of(field: FieldInfo) -> Sequence[str]:
    """The names that a leaf may have, where they are few and known: those of a table, or of a Literal."""
    tables = [marker.table for marker in field.metadata if isinstance(marker, OneOf)]
    if tables:
        return tuple(name for name in tables[0] if tables[0].belongs(name))
    return tuple(map(str, get_args(field.annotation))) if get_origin(field.annotation) is Literal else ()


def source_of(field: FieldInfo) -> str:
    """Source of a leaf's default, empty where none is declared."""
    return _declared(field, "source")


def _declared(field: FieldInfo, name: str) -> str:
    extra = field.json_schema_extra
    return str(extra.get(name, "")) if isinstance(extra, dict) else ""
