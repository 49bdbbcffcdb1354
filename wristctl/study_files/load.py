"""Read a study from files and overrides; every error says where it stands and how to mend it."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from wristctl.config.given_files import beside, names_a_file
from wristctl.config.leaves import named_in
from wristctl.config.study import Study
from wristctl.errors import Phrase, Setting, UserError, meant, worded
from wristctl.plugins.places import check_trust, check_within, placed
from wristctl.plugins.trust import asking
from wristctl.study_files.error_messages import explained
from wristctl.study_files.keys import field_at, home_of, keys_of, section_keys
from wristctl.study_files.shipped import shipped_name, shipped_names, study_file
from wristctl.study_files.strict_yaml import Document, KeyPath, parse_yaml

log = logging.getLogger(__name__)

# The end of a key path, and what has come in its place.
FORMER = {
    ("sensor", "seed"): "a camera's noise now comes from `seed`, the root of every random stream (--seed)",
    ("claims", "exact"): "each loop has a verdict of its own now, and `sense` says how a value is meant",
}


def leave_out_former(data: dict[str, Any], origins: Mapping[KeyPath, Phrase]) -> None:
    """Take former keys out of what files say; a warning names each kind of them once, with its first place."""
    removed: dict[tuple[str, str], KeyPath] = {}
    _take_out(data, (), removed)
    for former, path in removed.items():
        where = f"{worded(origins[path])}: " if path in origins else ""
        log.warning("%s%s is no longer a setting: %s", where, ".".join(map(str, path)), FORMER[former])


def _take_out(node: Any, path: KeyPath, removed: dict[tuple[str, str], KeyPath]) -> None:
    if isinstance(node, dict):
        for key in list(node):
            former = (next((part for part in reversed(path) if isinstance(part, str)), ""), str(key))
            if former in FORMER:
                del node[key]
                removed.setdefault(former, (*path, key))
            else:
                _take_out(node[key], (*path, key), removed)
    elif isinstance(node, list | tuple):
        for position, item in enumerate(node):
            _take_out(item, (*path, position), removed)


# The key of a study file that names others, which are read before it.
INCLUDE = "include"


def load_study(
    files: Sequence[Path] = (), overrides: Sequence[str] = (), command: str | None = None, trust_code: bool = False
) -> Study:
    """The study of `files`, then of the overrides `a.b=value`; later ones win, leaf by leaf.

    A file may be an experiment by its name, `quick`. A sequence is one leaf. An override's key is first looked for in
    the section of `command`: for train, `epochs=5` is `train.epochs=5`. With `trust_code` the code of runs that the
    study names may be loaded, now and later. Raises UserError with file and line (or override), key path, and nearest
    key or what is expected.
    """
    if not trust_code:
        return read_study(files, overrides, command)[0]
    with asking(lambda shown: True):
        study = read_study(files, overrides, command)[0]
        check_trust(name for _, name in named_in(study))
    return study


def read_study(
    files: Sequence[Path] = (), overrides: Sequence[str] = (), command: str | None = None
) -> tuple[Study, Mapping[KeyPath, Phrase]]:
    """As load_study, with the file and line (or override) of each key that was given."""
    data: dict[str, Any] = {}
    origins: dict[KeyPath, Phrase] = {}
    for file in files:
        path = study_file(file)
        if path is None:
            problem = f"there is no study file {Path.cwd() / file}, nor such an experiment of wristctl"
            raise UserError(problem, str(file), meant(shipped_name(file), shipped_names()))
        _merge_file(data, path, origins, ())
    leave_out_former(data, origins)
    for override in overrides:
        _merge(data, _whole(_override(override, command), None), Setting(override), origins)
    try:
        study = Study.model_validate(data, by_alias=True, by_name=False)
    except ValidationError as error:
        raise explained(error, origins) from error
    if _is_override(origins, "controller") and not _is_override(origins, "gains"):
        study.simulate.model_fields_set.discard("gains")  # the file's are for its own controller
    return study, origins


def _is_override(origins: Mapping[KeyPath, Phrase], leaf: str) -> bool:
    return any(path[:2] == ("simulate", leaf) and isinstance(origin, Setting) for path, origin in origins.items())


def _merge_file(data: dict[str, Any], file: Path, origins: dict[KeyPath, Phrase], outer: Sequence[Path]) -> None:
    """A file after those that it includes, which it names from where it stands."""
    document = _read(file)
    content = dict(document.data or {})
    included = content.pop(INCLUDE, ())
    where = f"{file}:{document.lines.get((INCLUDE,), 1)}"
    if not isinstance(included, tuple) or not all(isinstance(name, str) for name in included):
        raise UserError(f"{INCLUDE} should be a list of study files", where, f"{INCLUDE}: [scenarios/camera.yaml]")
    for name in included:
        inner = study_file(Path(name), file.parent)
        if inner is None or not inner.is_file():
            problem = f"there is no {file.parent / name} to include, nor such an experiment of wristctl"
            raise UserError(problem, where, "paths are from the file that includes")
        if inner.resolve() in [outer_file.resolve() for outer_file in (*outer, file)]:
            raise UserError(f"{inner} includes itself", where, "leave one of them out")
        check_within(inner, file)
        _merge_file(data, inner, origins, (*outer, file))
    lines = {path: line for path, line in document.lines.items() if path[0] != INCLUDE}
    _merge(data, _whole(Document(content, lines), file), str(file), origins)


def _read(file: Path) -> Document:
    try:
        text = file.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read the configuration: {error.strerror}", str(file), "check the path") from error
    document = parse_yaml(text, str(file))
    if document.data is not None and not isinstance(document.data, dict):
        raise UserError(
            "a study file holds keys and values",
            f"{file}:1",
            f"one of {', '.join(keys_of(Study))} at the top",
        )
    return document


def _whole(document: Document, file: Path | None) -> Document:
    """With the files and the code that it names by their whole paths, which count from the file, or else from here."""
    folder = file.parent if file else Path()
    return Document(placed(_found_from(document.data, folder), file), document.lines)


def whole_key(key: str, command: str | None) -> str:
    """A dotted key, or an override that begins with one, with the section in which a command looks for it."""
    first = key.partition("=")[0].partition(".")[0]
    return f"{home_of(command, first)}.{key}" if command and first in section_keys(command) else key


def _override(text: str, command: str | None) -> Document:
    dotted, equals, value = text.partition("=")
    where = Setting(text)
    if not equals or not dotted:
        raise UserError("an override is key=value", where, ("for example ", Setting("wrist.length=0.09")))
    keys = whole_key(dotted, command).split(".")
    command_keys, top = section_keys(command), keys_of(Study)
    if keys[0] not in top:
        raise UserError(f"unknown key {keys[0]!r}", where, meant(keys[0], dict.fromkeys([*command_keys, *top])))
    try:
        data = parse_yaml(value, "").data
    except UserError as error:
        raise error.at((where, error.where)) from error
    for key in reversed(keys):
        data = {key: data}
    return Document(data, {})


def _found_from(data: Any, folder: Path, path: KeyPath = ()) -> Any:
    """Data of a study file, with its file names resolved against a folder."""
    if isinstance(data, dict):
        return {key: _found_from(item, folder, (*path, key)) for key, item in data.items()}
    if not isinstance(data, str | tuple):
        return data
    if names_a_file(field_at(path)[1]):
        return beside(folder, data)
    return (
        tuple(_found_from(each, folder, (*path, position)) for position, each in enumerate(data))
        if isinstance(data, tuple)
        else data
    )


def _merge(data: dict[str, Any], document: Document, source: Phrase, origins: dict[KeyPath, Phrase]) -> None:
    def into(target: dict[str, Any], mapping: Mapping[str, Any], path: KeyPath) -> None:
        for key, value in mapping.items():
            deeper = (*path, key)
            origins[deeper] = source
            if isinstance(value, dict):
                if not isinstance(target.get(key), dict):
                    target[key] = {}
                into(target[key], value, deeper)
            else:
                target[key] = value
                for beneath in [old for old in origins if old[: len(deeper)] == deeper != old]:
                    del origins[beneath]

    into(data, document.data or {}, ())
    origins.update({path: f"{source}:{line}" for path, line in document.lines.items()})
