"""Read a study from files and overrides; every error says where it stands and how to mend it."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from wristctl.config.choices import CONTROLLERS
from wristctl.config.former_names import key_today
from wristctl.config.given_files import beside, names_a_file
from wristctl.config.leaves import named_by
from wristctl.config.plant import is_unsaid
from wristctl.config.study import Study
from wristctl.errors import Keyword, Phrase, Setting, UserError, fix_to_read, meant, nearest
from wristctl.plain_files import read_plain
from wristctl.plugins.places import check_trust, check_within, placed
from wristctl.plugins.trust import asking
from wristctl.study_files.error_messages import check_sizes, explained
from wristctl.study_files.keys import field_at, keys_of, section_keys, whole_key
from wristctl.study_files.keywords import as_a_file_has_it, function_of, in_full, keyword, path_of
from wristctl.study_files.renaming import (
    NewNames,
    leave_out_removed,
    note_presets,
    with_keys_of_today,
    with_loops_of_today,
)
from wristctl.study_files.resolved import check_mode, check_read, key_below
from wristctl.study_files.shipped import shipped_name, shipped_names, studies_beside, study_file
from wristctl.study_files.short_rows import GainsGiven, for_their_own_controller, in_lists, with_gains_apart
from wristctl.study_files.strict_yaml import Document, KeyPath, parse_yaml
from wristctl.study_files.typed_controllers import named_in, put_in

# The key of a study file that names others, which are read before it.
INCLUDE = "include"
# Study files of a folder that are named.
_NAMED = 5


def load_study(
    files: Sequence[Path] = (),
    overrides: Sequence[str] = (),
    command: str | None = None,
    trust_code: bool = False,
    force: bool = True,
) -> Study:
    """The study of `files`, then of the overrides `a.b=value`; later ones win, leaf by leaf.

    A file may be an experiment by its name, `quick`. A sequence is one leaf. An override's key is first looked for in
    the section of `command`: for train, `epochs=5` is `train.epochs=5`. It may be of no section that `command` does not
    read; files may hold any. With `trust_code` the code of runs that the
    study names may be loaded, now and later. Raises UserError with file and line (or override), key path, and nearest
    key or what is expected; without `force` also for a size that cannot well be meant.
    """
    with asking(lambda shown: True) if trust_code else nullcontext():
        study, origins = read_study(files, overrides, command)
        if not force:
            check_sizes(study, origins)
        if trust_code:
            check_trust(tuple(name for _, name in named_by(study)))
    return study.given_by({path: where for path, where in origins.items() if isinstance(where, Setting)})


def read_study(
    files: Sequence[Path] = (),
    overrides: Sequence[str | Setting] = (),
    command: str | None = None,
    note: bool = True,
    controllers: Sequence[str] = (),
    tune: bool = False,
    keywords: Mapping[str, Any] = MappingProxyType({}),
    base: Study | None = None,
) -> tuple[Study, Mapping[KeyPath, Phrase]]:
    """As load_study, with the file and line (or override) of each key that was given.

    A note names the former names among them, unless none is wanted. `controllers` were typed among the files of
    `command`, which tunes them first if it is to `tune`. `keywords` are sections of a study, or keys of the command's
    own, as the function of `command` is given them: `wrist` may be a study file. All of it comes after the study
    `base`.
    """
    data: dict[str, Any] = {} if base is None else base.model_dump(by_alias=True, exclude_unset=True)
    origins: dict[KeyPath, Phrase] = {}
    former, gains_given = NewNames(), GainsGiven()
    for file in files:
        path = study_file(file)
        if path is None:
            problem = f"there is no study file {Path.cwd() / file}, nor such an experiment of wristctl"
            raise UserError(problem, str(file), _in_place_of(str(file), files, command))
        if path.suffix == ".py" and "controller" in section_keys(command):
            own = named_in(path)
            raise UserError(f"{file} is no study file", str(file), ("its controller: ", _as_controller(own, command)))
        _merge_file(data, path, origins, (), former)
    leave_out_removed(data, origins)
    for override in overrides:
        setting = Setting(override) if isinstance(override, str) else override
        whole = _override(setting, command)
        today = _today(whole, setting, None, former)
        gains_given.note(whole.data, today.data, setting)
        _merge(data, today, setting, origins)
    for name, value in keywords.items():
        _merge_keyword(data, origins, name, value, command or "", former, gains_given)
    with_loops_of_today(data, origins, former)
    put_in(data, origins, controllers, command or "", tune)
    note_presets(data, origins, former)
    if note:
        former.note()
    for_another = for_their_own_controller(data, origins)
    in_lists(data, origins)
    try:
        study = Study.model_validate(data, by_alias=True, by_name=False)
    except ValidationError as error:
        raise explained(error, origins, command) from error
    _refuse_horizon_of_worlds(study, origins, command)
    check_mode(study, command, origins)
    if for_another:
        study.simulate.model_fields_set.discard("gains")
    given, fields = study.wrist.model_fields_set, type(study.wrist).model_fields
    every = all(name in given or is_unsaid(field) for name, field in fields.items())
    if every and not isinstance(origins.get(("wrist", "hand_mass")), Setting):
        given.discard("hand_mass")  # as a run writes it: nobody has said the default
    return study, origins


def _refuse_horizon_of_worlds(study: Study, origins: Mapping[KeyPath, Phrase], command: str | None) -> None:
    """UserError where an override gives a horizon to a command whose worlds have their own, which would go unread."""
    if command not in ("compare", "tune") or not isinstance(where := origins.get((command, "horizon")), Setting):
        return
    family = getattr(study, command).worlds.family
    if family:
        key = f"families.{family}.horizon"
        problem = f"the worlds of {family} have a horizon of their own"
        raise UserError(problem, (where, f": {command}.horizon"), Setting(where.text.replace("horizon", key, 1)))


def _in_place_of(file: str, files: Sequence[Path], command: str | None) -> Phrase:
    """Advice where there is no such study file: how controllers are given, where it has the name of one."""
    keys = section_keys(command)
    if file not in CONTROLLERS or not keys.keys() & {"controller", "controllers"}:
        ending = ".yaml" * file.endswith(".yaml")  # which is no likeness of two files
        beside = {name.removesuffix(ending): name for name in studies_beside(Path(file))}
        own = beside.get(nearest(file.removesuffix(ending), beside) or "")
        return f"did you mean {own!r}?" if own else meant(shipped_name(Path(file)), shipped_names())
    if "controller" in keys:
        return (f"{file} is a controller: ", _as_controller(file, command))
    names = [str(other) for other in files if str(other) in CONTROLLERS]
    in_python = f"controllers={names!r}"
    if keys_of(field_at((command or "", "controllers", 0))[0]):
        names = [f"{{controller: {name}, gains: {_a_preset(name)}}}" for name in names]
    option = Setting(f"controllers=[{', '.join(names)}]", quoted=True).typed
    return (f"{file} is a controller: ", Keyword(in_python, option=option, function=function_of(command or "")))


def _as_controller(name: str, command: str | None) -> Keyword:
    """How a command, or its function, is given its controller."""
    return Keyword(f"controller={name!r}", option=f"--controller {name}", function=function_of(command or ""))


def _a_preset(name: str) -> str:
    """A preset of a controller; of one from elsewhere, which nothing loads here, the usual name."""
    return next(iter(CONTROLLERS[name].presets)) if CONTROLLERS.belongs(name) else "default"


def _merge_file(
    data: dict[str, Any], file: Path, origins: dict[KeyPath, Phrase], outer: Sequence[Path], former: NewNames
) -> None:
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
        _merge_file(data, inner, origins, (*outer, file), former)
    lines = {path: line for path, line in document.lines.items() if path[0] != INCLUDE}
    _merge(data, _today(Document(content, lines), str(file), file, former), str(file), origins)


def _merge_keyword(
    data: dict[str, Any], origins: dict[KeyPath, Phrase], name: str, value: Any, command: str, former: NewNames,
    gains_given: GainsGiven,
) -> None:  # fmt: skip
    """An argument of a command's function: a section, a key of the command's own, or the wrist of a study file."""
    where, path = keyword(name, value, command), path_of(name, command)
    if name == "wrist" and isinstance(value, str | Path):
        _merge_wrist(data, origins, Path(value), where, former)
        return
    whole = in_full(as_a_file_has_it(value, where), path)
    for key in reversed(path):
        whole = {key: whole}
    today = _today(Document(whole, {}), where, None, former)
    gains_given.note(whole, today.data, where)
    _merge(data, today, where, origins)


def _merge_wrist(
    data: dict[str, Any], origins: dict[KeyPath, Phrase], named: Path, where: Keyword, former: NewNames
) -> None:
    """The wrist of a study file, whose other sections are not read."""
    file = study_file(named)
    if file is None:
        raise UserError(f"there is no study file {Path.cwd() / named}", where, _in_place_of(str(named), (), None))
    content: dict[str, Any] = {}
    lines: dict[KeyPath, Phrase] = {}
    _merge_file(content, file, lines, (), former)
    if "wrist" not in content:
        raise UserError("the file has no section wrist", str(file), "wrist: {length: 0.09, stiffness: 0.8}")
    _merge(data, Document({"wrist": content["wrist"]}, {}), str(file), origins)
    origins.update({path: line for path, line in lines.items() if path[0] == "wrist"})


def _read(file: Path) -> Document:
    try:
        text = read_plain(file)
    except OSError as error:
        problem = f"cannot read the configuration: {error.strerror}"
        raise UserError(problem, str(file), _studies_in(file) or fix_to_read(error)) from error
    document = parse_yaml(text, str(file))
    if document.data is not None and not isinstance(document.data, dict):
        fix = f"one of {', '.join(keys_of(Study))} at the top"
        raise UserError("a study file holds keys and values", f"{file}:1", fix)
    return document


def _studies_in(folder: Path) -> str:
    """Advice on a folder that was named as a study file: the first of the study files in it."""
    try:
        names = sorted(file.name for file in folder.iterdir() if file.suffix in (".yaml", ".yml"))
    except OSError:
        return ""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"name a study file in it: {', '.join(names[:_NAMED])}{more}" if names else "it holds no study file"


def _today(document: Document, where: Phrase, file: Path | None, former: NewNames) -> Document:
    """With keys as they are called today, and gains apart from controllers.

    The files and the code that it names have their whole paths, which count from the file, or else from here.
    """
    document = with_keys_of_today(document, where, former)
    document = with_gains_apart(Document(_all_in_full(document.data, lines := dict(document.lines)), lines), where)
    folder = file.parent if file else Path()
    return Document(placed(_found_from(document.data, folder), file), document.lines)


def _override(where: Setting, command: str | None) -> Document:
    dotted, equals, value = where.text.partition("=")
    if not equals or not dotted:
        raise UserError("an override is key=value", where, ("for example ", Setting("wrist.length=0.09")))
    keys = whole_key(dotted, command).split(".")
    command_keys, top = section_keys(command), keys_of(Study)
    if key_today(tuple(keys))[0] not in top:
        below = ".".join([key_below(keys[0], command), *keys[1:]]) if key_below(keys[0], command) else ""
        fix = f"did you mean {below!r}?" if below else meant(keys[0], dict.fromkeys([*command_keys, *top]))
        raise UserError(f"unknown key {keys[0]!r}", where, fix)
    if command is not None:
        check_read(".".join(map(str, key_today(tuple(keys)))), command, where)
    try:
        data = parse_yaml(value, "").data
    except UserError as error:
        raise error.at((where, error.where)) from error
    for key in reversed(keys):
        data = {key: data}
    return Document(data, {})


def _all_in_full(data: Any, lines: dict[KeyPath, int], path: KeyPath = ()) -> Any:
    """Data of a study file, with a name alone as what it stands for, as `in_full` has it; its line is that of each."""
    if isinstance(data, dict):
        return {key: _all_in_full(item, lines, (*path, key)) for key, item in data.items()}
    if isinstance(data, tuple):
        return tuple(_all_in_full(item, lines, (*path, position)) for position, item in enumerate(data))
    whole = data if path == ("sweep",) else in_full(data, path)  # a run that was swept has a list there
    if isinstance(whole, dict) and path in lines:
        lines |= {(*path, key): lines[path] for key in whole}
    return whole


def _found_from(data: Any, folder: Path, path: KeyPath = ()) -> Any:
    """Data of a study file, with its file names resolved against a folder."""
    if isinstance(data, dict):
        return {key: _found_from(item, folder, (*path, key)) for key, item in data.items()}
    if not isinstance(data, str | tuple):
        return data
    if names_a_file(field_at(path)[1]):
        return beside(folder, data)
    if isinstance(data, str):
        return data
    return tuple(_found_from(each, folder, (*path, position)) for position, each in enumerate(data))


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
