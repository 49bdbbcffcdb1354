"""A study written out in full: every leaf, in the schema's order, with unit, meaning and source."""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import yaml

from wristctl.config.choices import CONTROLLERS
from wristctl.config.foreign import PLAIN
from wristctl.config.plant import is_unsaid
from wristctl.config.section import OpenSection, Parameter, Section
from wristctl.config.study import Study
from wristctl.study_files.keys import SUBJECTS, choices_of, keys_of, source_of, unit_of
from wristctl.study_files.strict_yaml import parse_yaml

_WORD = re.compile(r"[A-Za-z0-9_./][A-Za-z0-9_./ -]*[A-Za-z0-9_./]|[A-Za-z_/]")

Entry = tuple[str, Any, str]

_SHARED = ("seed", "wrist")
_OWN = "controller-settings"
_READ: dict[str, tuple[str, ...]] = {"train": ("gen-data",), "simulate": (_OWN, "sweep"), "hw-run": (_OWN,)}
_READ |= dict.fromkeys(("tune", "compare"), ("families", _OWN, "sweep")) | {"study": ("families", _OWN)}
_READ |= {command: (subject, _OWN) for command, subject in SUBJECTS.items()}
"""Sections that a command reads beside its own: without a data run, train draws what gen-data would."""


def sections_read(command: str) -> tuple[str, ...]:
    """The sections of a study that a command reads, by their names as attributes."""
    return tuple(name.replace("-", "_") for name in _keys(command) if name in keys_of(Study) and name not in _SHARED)


def resolved_yaml(study: Study, command: str) -> str:
    """Part of a study that `command` reads (seed, wrist, sections), as YAML that gives the same study."""
    entries = [entry for entry in _entries(study) if entry[0] in _keys(command)]
    return "\n".join(_mapping(entries, "")) + "\n"


def config_hash(study: Study, command: str) -> str:
    """SHA-256 of what `command` reads, as canonical JSON."""
    part = study.model_dump(mode="json", by_alias=True, include=names_read(command))
    return hashlib.sha256(json.dumps(part, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def names_read(command: str) -> set[str]:
    """The fields of a study that a command reads."""
    return {name.replace("-", "_") for name in _keys(command)}


def _keys(command: str) -> Sequence[str]:
    return (*_SHARED, command, *_READ.get(command, ()))


def _entries(section: Section) -> Iterator[Entry]:
    for (key, field), name in zip(keys_of(type(section)).items(), type(section).model_fields, strict=True):
        value = getattr(section, name)
        if is_unsaid(field) and value == field.default:
            continue
        unit, source = unit_of(field), source_of(field) if value == field.default else ""
        choices = ", ".join(choices_of(field))
        meaning = f"{field.description or ''}{choices and f': {choices}'}"
        parts = (unit and f"[{unit}]", meaning, source and f"({source})")
        yield key, value, " ".join(part for part in parts if part)
    if isinstance(section, OpenSection):
        for name in section.model_extra or ():
            yield name, section.value(name), _parameter(section.added()[name])


def _mapping(entries: Iterable[Entry], pad: str) -> Iterator[str]:
    for key, value, comment in entries:
        remark = f"  # {comment}" if comment else ""
        if isinstance(value, Section):
            yield f"{pad}{_scalar(key)}:{remark}"
            yield from _mapping(_entries(value), pad + "  ")
        elif isinstance(value, dict) and value:
            yield f"{pad}{_scalar(key)}:{remark}"
            yield from _mapping(((name, item, _of_a_law(key, name)) for name, item in value.items()), pad + "  ")
        elif isinstance(value, tuple) and any(isinstance(item, Section) for item in value):
            yield f"{pad}{_scalar(key)}:{remark}"
            for item in value:
                first, *further = _mapping(_entries(item), pad + "    ")
                yield f"{pad}  - {first.lstrip()}"
                yield from further
        else:
            yield f"{pad}{_scalar(key)}: {_flow(value)}{remark}"


def _of_a_law(law: str, setting: str) -> str:
    """Unit and meaning of a setting of a law from elsewhere, which has been loaded by now; empty of all else."""
    for name in (law, law + PLAIN):
        if CONTROLLERS.origin(name) is not None and setting in CONTROLLERS[name].settings:
            return _parameter(CONTROLLERS[name].settings[setting])
    return ""


def _parameter(added: Parameter) -> str:
    return f"[{added.unit}] {added.meaning}" if added.unit else added.meaning


def _flow(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_flow, value))}]"
    return "{}" if isinstance(value, dict) else _scalar(value)


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        if _WORD.fullmatch(value) and parse_yaml(value, "").data == value:
            return value
        return yaml.safe_dump(value, default_style='"', width=10**9, allow_unicode=True).strip()
    return (
        {None: "null", True: "true", False: "false"}[value] if value is None or isinstance(value, bool) else repr(value)
    )
