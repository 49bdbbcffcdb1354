"""Code that a study names by its place, path/to/file.py:NAME, or by an entry point: where it is from, and loaded."""

import logging
import os
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any

from wristctl.config.foreign import Foreign, is_reference, split
from wristctl.config.former_names import file_today
from wristctl.config.leaves import renamed_in_sweep, swept_controllers
from wristctl.errors import UserError, meant
from wristctl.interrupt import from_outside
from wristctl.plugins.import_hook import imported, root_of
from wristctl.plugins.trust import digest_now, run_around, trusted

log = logging.getLogger(__name__)

_PACKAGE = os.path.join(Path(__file__).parents[1], "")


def placed(value: Any, document: Path | None) -> Any:
    """The data of a study with its references made whole: relative ones count from the document, or else from here.

    Raises UserError where the document is part of a run and names code that is not.
    """
    if isinstance(value, dict):
        data = {key: entry if key == "sweep" else placed(entry, document) for key, entry in value.items()}
        if _are_axes(value.get("sweep")):
            data["sweep"] = renamed_in_sweep(value["sweep"], lambda _, name: str(placed(name, document)))
        return data
    if isinstance(value, tuple):
        return tuple(placed(entry, document) for entry in value)
    if not isinstance(value, str) or not is_reference(value):
        return value
    file, attribute = split(value)
    full_path = Path(os.path.abspath((document.parent if document else Path()) / file.expanduser()))
    if (moved := file_today(full_path)) != full_path:
        log.warning("%s is now %s", full_path, moved)
    if document:
        check_within(moved, document)
    return f"{moved}:{attribute}"


def _are_axes(entry: Any) -> bool:
    """Whether these are texts, as a sweep's KEY=VALUES; anything else in their place is left to the validation."""
    return isinstance(entry, tuple) and all(isinstance(text, str) for text in entry)


def check_within(named: Path, document: Path) -> None:
    """Raises UserError where a document that is part of a run names code, or another document, outside the run."""
    home = run_around(document)
    if home and not named.resolve().is_relative_to(home.resolve()):
        fix = "name it in a study file of your own"
        raise UserError("the configuration of a run names code outside the run", str(named), fix)


def check_trust(named: Any, document: Path | None = None) -> None:
    """Ask whether the code that the data of a document names may be loaded, and load none of it. Raises UserError."""
    for reference in _references(placed(named, document)):
        file, _ = split(reference)
        trusted(file, root_of(file))


def _references(value: Any) -> Iterator[str]:
    """Every reference in the data of a study, and every controller that its sweep takes in turn, as their places."""
    if isinstance(value, str) and is_reference(value):
        yield value
    elif isinstance(value, tuple):
        yield from chain.from_iterable(map(_references, value))
    elif isinstance(value, dict):
        for key, entry in value.items():
            is_sweep = key == "sweep" and _are_axes(entry)
            yield from filter(is_reference, swept_controllers(entry)) if is_sweep else _references(entry)


_loaded: dict[Path, tuple[ModuleType, dict[Path, str]]] = {}


def load(reference: str, calls: Sequence[str] = ()) -> tuple[Any, Foreign]:
    """The object that a reference names, and where it is from. A source that was changed is read again.

    Raises UserError where there is no such file or name, where it cannot be imported, and where it lies in a run and
    nobody has said that it may be loaded. In place of a name that is none those are proposed that have these calls.
    """
    path, attribute = split(reference)
    file = Path(os.path.abspath(path.expanduser()))
    if not file.is_file():
        raise UserError(f"no file {file.name}", str(file), "check the path: it counts from the file that names it")
    cached = _loaded.get(file)
    if cached is None or any(digest_now(source) != digest for source, digest in cached[1].items()):
        cached = _loaded[file] = imported(file)
    module, files = cached
    if not hasattr(module, attribute):
        members = {name: member for name, member in vars(module).items() if not name.startswith("_")}
        own = {n: m for n, m in members.items() if not callable(m) or getattr(m, "__module__", "") == module.__name__}
        names = [
            name
            for name, member in own.items()
            if not isinstance(member, ModuleType) and all(callable(getattr(member, call, None)) for call in calls)
        ]
        raise UserError(f"{file.name} has no {attribute}", str(file), meant(attribute, names))
    return getattr(module, attribute), Foreign(file, attribute, files, root_of(file))


@contextmanager
def contained(activity: str, where: str) -> Iterator[None]:
    """Within the block, which runs code from elsewhere, all that it raises is the user's error: SystemExit too.

    Only Ctrl-C passes. `what` failed, at `where` unless the error knows its place.
    """
    try:
        yield
    except BaseException as error:
        if isinstance(error, UserError) or from_outside(error):
            raise
        problem = f"{activity} failed: {type(error).__name__}: {error}".rstrip(": ")
        raise UserError(problem, raised_at(error) or where, "mend it there; --debug shows more") from error


def raised_at(error: BaseException) -> str:
    """FILE:LINE where code from elsewhere has raised an error: the innermost place that is not the package's."""
    places = [f"{frame.filename}:{frame.lineno}" for frame in traceback.extract_tb(error.__traceback__)]
    return next((place for place in places[::-1] if not place.startswith((_PACKAGE, "<"))), "")


def installed(module: ModuleType, attribute: str) -> Foreign:
    """Origin of an object of an installed package: its module and all loaded modules of the package."""
    package = module.__name__.partition(".")[0]
    loaded_modules = [
        loaded for name, loaded in list(sys.modules.items()) if name == package or name.startswith(f"{package}.")
    ]
    names = [str(getattr(loaded, "__file__", None)) for loaded in loaded_modules]
    files = [Path(path) for path in names if path.endswith(".py")]
    file = Path(str(module.__file__))
    root = file.parents[module.__name__.count(".") + (file.name == "__init__.py")]
    return Foreign(file, attribute, {source: digest_now(source) for source in sorted(files)}, root)


@cache
def _of(group: str) -> Mapping[str, Sequence[Any]]:
    """Entry points of a group by name. A name should have one."""
    from importlib.metadata import entry_points

    candidates: dict[str, list[Any]] = {}
    for candidate in entry_points(group=group):
        if candidate.value not in [previous.value for previous in candidates.setdefault(candidate.name, [])]:
            candidates[candidate.name].append(candidate)
    return candidates


def entry_point_names(group: str) -> Sequence[str]:
    """The names of a group."""
    return tuple(_of(group))


def entry_point(group: str, name: str) -> tuple[Any, Foreign]:
    """The object behind the one entry point of this name, and where it is from.

    Raises UserError where several packages have one of this name, and where it cannot be loaded.
    """
    candidates = _of(group)[name]
    if len(candidates) > 1:
        where = ", ".join(f"{one.dist.name if one.dist else '?'} ({one.value})" for one in candidates)
        problem = f"{len(candidates)} installed packages have a '{name}' in {group}"
        raise UserError(problem, where, "uninstall all but one")
    (only,) = candidates
    with contained(f"loading the entry point '{name}'", f"{group}: {only.value}"):
        target = only.load()
    return target, installed(sys.modules[only.module], only.attr)
