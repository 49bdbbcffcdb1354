"""A study written out in full: every leaf, in the schema's order, with unit, meaning and source."""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import yaml

from wristctl.config.choices import CONTROLLERS
from wristctl.config.foreign import PLAIN
from wristctl.config.loop import LOOPS
from wristctl.config.plant import is_unsaid
from wristctl.config.section import OpenSection, Parameter, Section
from wristctl.config.study import Study
from wristctl.errors import Phrase, Setting, UserError
from wristctl.study_files.keys import (
    NO_COMMANDS,
    SUBJECTS,
    choices_of,
    command_of,
    field_at,
    home_of,
    keys_of,
    section_keys,
    source_of,
    unit_of,
)
from wristctl.study_files.strict_yaml import KeyPath, parse_yaml

_WORD = re.compile(r"[A-Za-z0-9_./][A-Za-z0-9_./ -]*[A-Za-z0-9_./]|[A-Za-z_/]")

Entry = tuple[str, Any, str]


class _Part(list[Entry]):
    """Some entries of a section."""


_SHARED = ("seed", "wrist")
_OWN = "controller-settings"
_READ: dict[str, tuple[str, ...]] = {"train": ("gen-data",), "simulate": (_OWN, "sweep")}
_READ |= dict.fromkeys(("hw-run", "recommend"), (_OWN,))
_READ |= dict.fromkeys(("tune", "compare"), ("families", _OWN, "sweep")) | {"study": ("families", _OWN)}
_READ |= {command: (subject, _OWN) for command, subject in SUBJECTS.items()}
_READ["analyse"] += ("hysteresis",)
"""Sections that a command reads beside its own: without a data run, train draws what gen-data would."""
_UNREAD = {"loop": ("hysteresis",), "hysteresis": ("simulate", _OWN)}
"""What `analyse` leaves alone of them, by what it is of."""
_WITHIN = {("compare", "tune"): "compare.tuning"}
"""What a command has of its own in place of another's section."""
_PASSED_ON: dict[str, tuple[str, ...]] = {"recommend": ("simulate", "hw-run"), "calibrate-camera": ("track",)}
"""Sections whose settings go into the files that a command writes: the study of a recommendation, printed markers."""


def sections_read(command: str, study: Study | None = None) -> tuple[str, ...]:
    """The sections that a command reads, of a study or of any, by their names as attributes."""
    read = _keys(command, study)
    return tuple(name.replace("-", "_") for name in read if name in keys_of(Study) and name not in _SHARED)


def check_read(key: str, command: str, where: Phrase) -> None:
    """UserError, naming the commands that read it, for a dotted key of a section that `command` does not read.

    Keys that no study has pass: another error tells those.
    """
    section = key.partition(".")[0]
    if section not in keys_of(Study) or section in (*_keys(command), *_PASSED_ON.get(command, ())):
        return
    commands = [name for name in dict.fromkeys([*keys_of(Study), *SUBJECTS]) if name not in NO_COMMANDS]
    readers = [command_of(name) for name in commands if section in _keys(name)]
    read = f"`{'`, `'.join(f'wristctl {reader}' for reader in readers)}` read{'s' * (len(readers) == 1)} it"
    fix = f"{read}; a study file may hold it beside what {command_of(command)} reads"
    if within := _WITHIN.get((command, section)):
        fix = f"{within}{key.removeprefix(section)}: the search that {command} makes itself, of gains: tuned; {fix}"
    raise UserError(f"{command_of(command)} does not read {key}", where, fix)


def key_below(key: str, command: str | None) -> str:
    """The dotted key of this name one level below a study's or a command's own, the wrist's first; empty where there
    are none or several among what the command reads."""
    if key in keys_of(field_at(("wrist",))[0]):
        return f"wrist.{key}"
    sections = [(name,) for name in (_keys(command) if command else keys_of(Study))]
    groups = [(home_of(command, own), own) for own in section_keys(command)] if command else []
    found = [(*group, key) for group in [*sections, *groups] if key in keys_of(field_at(group)[0])]
    return ".".join(found[0]) if len(found) == 1 else ""


def check_mode(study: Study, command: str | None, origins: Mapping[KeyPath, Phrase]) -> None:
    """UserError for an override of what `analyse` does not read of a loop, or of hysteresis."""
    of, other = study.analyse.of, next(name for name in _UNREAD if name != study.analyse.of)

    def is_unread(path: KeyPath) -> bool:
        own = path[0] == "analyse" and of == "hysteresis" and path[1:] not in ((), ("of",))
        return isinstance(origins[path], Setting) and (own or path[0] in _UNREAD[of])

    if command == "analyse" and (unread := [path for path in origins if is_unread(path)]):
        path, what = max(unread, key=len), {"loop": "a loop"}.get(of, of)
        fix = (
            "leave it out, or ",
            Setting(f"of={other}", "analyse", option=f"--of {other}"),
            " (documentation: Hysteresis of the wrist)",
        )
        raise UserError(f"an analysis of {what} does not read {'.'.join(map(str, path))}", origins[path], fix)


def resolved_yaml(study: Study, command: str) -> str:
    """Part of a study that `command` reads (seed, wrist, sections), as YAML that gives the same study."""
    entries = [entry for entry in _entries(study) if entry[0] in _keys(command, study)]
    return "\n".join(_mapping(entries, "")) + "\n"


def changed_yaml(study: Study, command: str) -> str:
    """The settings of what `command` reads that are not at their defaults, as YAML that gives the same study."""
    changed = [entry for entry in _changed(study) if entry[0] in _keys(command, study)]
    return "\n".join(_mapping(changed, "")) + "\n" if changed else ""


def _changed(section: Section, of_several: bool = False) -> _Part:
    """Entries that are not at their defaults, or all of them where a preset among them has set others.

    The first, which tells one of several from another, is always there.
    """
    part, whole = _Part(), _Part()
    for (key, value, comment), name in zip(_entries(section, False), _names(section), strict=True):
        entry, field = (key, _reduced(value), comment), type(section).model_fields.get(name)
        whole.append(entry)
        if field is None or value != field.get_default(call_default_factory=True) or (of_several and not part):
            part.append(entry)
    dumped, kept = section.model_dump(by_alias=True), {key for key, _, _ in part}
    try:
        again = type(section).model_validate({key: dumped[key] for key in kept}, by_alias=True, by_name=False)
    except ValueError:
        return whole
    return part if again == section else whole


def _reduced(value: Any) -> Any:
    """A value with its sections cut down to what is changed in them."""
    if isinstance(value, Section):
        return _changed(value)
    if isinstance(value, tuple):
        return tuple(_changed(item, True) if isinstance(item, Section) else item for item in value)
    if isinstance(value, dict):  # what is left out of a built-in loop is that one's
        return {name: item if name in LOOPS else _reduced(item) for name, item in value.items()}
    return value


def config_hash(study: Study, command: str) -> str:
    """SHA-256 of what `command` reads, as canonical JSON."""
    part = study.model_dump(mode="json", by_alias=True, include=names_read(command, study))
    return hashlib.sha256(json.dumps(part, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def names_read(command: str, study: Study | None = None) -> set[str]:
    """The fields that a command reads, of a study or of any."""
    return {name.replace("-", "_") for name in _keys(command, study)}


def _keys(command: str, study: Study | None = None) -> Sequence[str]:
    unread = () if study is None or command != "analyse" else _UNREAD.get(study.analyse.of, ())
    return tuple(name for name in (*_SHARED, command, *_READ.get(command, ())) if name not in unread)


def _names(section: Section) -> list[str]:
    """Attributes of a section in the order of its entries."""
    fields = type(section).model_fields.items()
    names = [name for name, field in fields if not (is_unsaid(field) and getattr(section, name) == field.default)]
    return [*names, *((section.model_extra or ()) if isinstance(section, OpenSection) else ())]


def _entries(section: Section, with_choices: bool = True) -> Iterator[Entry]:
    for (key, field), name in zip(keys_of(type(section)).items(), type(section).model_fields, strict=True):
        value = getattr(section, name)
        if is_unsaid(field) and value == field.default:
            continue
        unit, source = unit_of(field), source_of(field) if value == field.default else ""
        choices = ", ".join(choices_of(field)) if with_choices else ""
        meaning = f"{field.description or ''}{choices and f': {choices}'}"
        parts = (unit and f"[{unit}]", meaning, source and f"({source})")
        yield key, value, " ".join(part for part in parts if part)
    if isinstance(section, OpenSection):
        for name in section.model_extra or ():
            yield name, section.value(name), _parameter(section.added()[name])


def _mapping(entries: Iterable[Entry], pad: str) -> Iterator[str]:
    for key, value, comment in entries:
        remark = f"  # {comment}" if comment else ""
        if isinstance(value, Section | _Part) and value:
            yield f"{pad}{_scalar(key)}:{remark}"
            yield from _mapping(_inner(value), pad + "  ")
        elif isinstance(value, dict) and value:
            yield f"{pad}{_scalar(key)}:{remark}"
            yield from _mapping(((name, item, _of_a_law(key, name)) for name, item in value.items()), pad + "  ")
        elif isinstance(value, tuple) and any(isinstance(item, Section | _Part) for item in value):
            yield f"{pad}{_scalar(key)}:{remark}"
            for number, item in enumerate(value):
                inner = _inner(item)
                if number and isinstance(item, _Part):  # what a setting means is said once
                    inner = [(name, held, "") for name, held, _ in inner]
                first, *further = _mapping(inner, pad + "    ")
                yield f"{pad}  - {first.lstrip()}"
                yield from further
        else:
            yield f"{pad}{_scalar(key)}: {_flow(value)}{remark}"


def _inner(value: Section | _Part) -> Iterable[Entry]:
    return _entries(value) if isinstance(value, Section) else value


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
    return "{}" if isinstance(value, dict | _Part) else _scalar(value)


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        if _WORD.fullmatch(value) and parse_yaml(value, "").data == value:
            return value
        return yaml.safe_dump(value, default_style='"', width=10**9, allow_unicode=True).strip()
    return json.dumps(value) if value is None or isinstance(value, bool) else repr(value)
