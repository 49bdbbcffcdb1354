"""Code that a study names by its place, path/to/file.py:NAME: found, trusted and loaded with the modules beside it.

What is loaded is the text of the sources as it was hashed: bytecode and libraries beside them are never looked at.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.machinery import FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import spec_from_loader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from wristctl.config.errors import UserError, meant
from wristctl.config.trust import run_around, trusted

PLAIN = "(py)"
"""How the names of laws end that are plain Python."""

_REFERENCE = re.compile(r"[^\n]*\.py:[A-Za-z_]\w*")
_PREFIX = "wristctl_foreign_"


@dataclass(frozen=True)
class Foreign:
    """Where an object from elsewhere is from: its file, its name there, and every source it rests on with its hash."""

    file: Path
    attribute: str
    files: Mapping[Path, str]
    """SHA-256 of the file and of the modules beside it that it imports, when they were loaded."""
    root: Path
    """The folder below which all of them are."""

    @property
    def reference(self) -> str:
        """As a study names it."""
        return f"{self.file}:{self.attribute}"


def is_reference(name: str) -> bool:
    """Whether a name is the place of an object in a file."""
    return _REFERENCE.fullmatch(name) is not None


def split(reference: str) -> tuple[Path, str]:
    """File and name of a reference."""
    file, _, attribute = reference.rpartition(":")
    return Path(file), attribute


def placed(value: Any, document: Path | None) -> Any:
    """The data of a study with its references made whole: relative ones count from the document, or else from here.

    Raises UserError where the document is part of a run and names code that is not.
    """
    if isinstance(value, dict):
        return {key: placed(each, document) for key, each in value.items()}
    if isinstance(value, tuple):
        return tuple(placed(each, document) for each in value)
    if not isinstance(value, str) or not is_reference(value):
        return value
    file, attribute = split(value)
    whole = Path(os.path.abspath((document.parent if document else Path()) / file.expanduser()))
    home = run_around(document) if document else None
    if home and not whole.resolve().is_relative_to(home.resolve()):
        fix = "name a law of your own in a study file of your own"
        raise UserError("the configuration of a run names code outside the run", str(whole), fix)
    return f"{whole}:{attribute}"


def check_trust(leaves: Iterable[Any], document: Path) -> None:
    """Ask whether the code that the leaves of a document name may be loaded, and load none of it. Raises UserError."""
    for each in placed(tuple(leaves), document):
        for name in each if isinstance(each, tuple) else (each,):
            if isinstance(name, str) and is_reference(name):
                file, _ = split(name)
                trusted(file, _root(file))


_loaded: dict[Path, tuple[ModuleType, dict[Path, str]]] = {}


def load(reference: str) -> tuple[Any, Foreign]:
    """The object that a reference names, and where it is from. A source that was changed is read again.

    Raises UserError where there is no such file or name, where it cannot be imported, and where it lies in a run and
    nobody has said that it may be loaded.
    """
    given, attribute = split(reference)
    file = Path(os.path.abspath(given.expanduser()))
    if not file.is_file():
        raise UserError(f"no file {file.name}", str(file), "check the path: it counts from the file that names it")
    known = _loaded.get(file)
    if known is None or any(_digest_now(each) != digest for each, digest in known[1].items()):
        known = _loaded[file] = _imported(file)
    module, files = known
    if not hasattr(module, attribute):
        own = {name: each for name, each in vars(module).items() if not name.startswith("_")}
        names = [name for name, each in own.items() if not callable(each) and not isinstance(each, ModuleType)]
        raise UserError(f"{file.name} has no {attribute}", str(file), meant(attribute, names))
    return getattr(module, attribute), Foreign(file, attribute, files, _root(file))


def installed(module: ModuleType, attribute: str) -> Foreign:
    """Where an object of an installed package is from: its module, with all that is loaded of the package."""
    package = module.__name__.partition(".")[0]
    own = [each for name, each in list(sys.modules.items()) if name == package or name.startswith(f"{package}.")]
    names = [str(getattr(each, "__file__", None)) for each in own]
    files = [Path(each) for each in names if each.endswith(".py")]
    file = Path(str(module.__file__))
    root = file.parents[module.__name__.count(".") + (file.name == "__init__.py")]
    return Foreign(file, attribute, {each: _digest_now(each) for each in sorted(files)}, root)


def _digest_now(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:
        return ""


class _Source(SourceFileLoader):
    """Loads the text of a module itself; `seen` takes the hash of each, which must be the agreed one where one is."""

    def __init__(self, name: str, path: str, seen: dict[Path, str], agreed: Mapping[Path, str] | None) -> None:
        super().__init__(name, path)
        self._seen, self._agreed = seen, agreed

    def get_code(self, fullname: str) -> CodeType:
        """Compiled from the source, never from bytecode."""
        file = Path(self.path)
        content = file.read_bytes()
        digest = hashlib.sha256(content).hexdigest()
        if self._agreed is not None and self._agreed.get(file) != digest:
            raise UserError("the code of a run changed after it was shown", self.path, "look at it again")
        self._seen[file] = digest
        code: CodeType = compile(content, self.path, "exec", dont_inherit=True)
        return code


class _Beside:
    """Finds the modules beside a file, before those of the same name elsewhere; the standard library comes first."""

    def __init__(
        self, folder: Path, name: str, file: Path, seen: dict[Path, str], agreed: Mapping[Path, str] | None
    ) -> None:
        self._folder, self._name, self._file = folder, name, file
        self._made: Any = lambda name, path: _Source(name, path, seen, agreed)

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: Any = None) -> ModuleSpec | None:
        """The module's, where it stands beside the file or within a package there."""
        if name == self._name and "." not in name:
            made: ModuleSpec | None = spec_from_loader(name, self._made(name, str(self._file)))
            return made
        if name.partition(".")[0] in sys.stdlib_module_names:
            return None
        for folder in [str(self._folder)] if path is None else list(path):
            if Path(folder).is_relative_to(self._folder):
                found = FileFinder(folder, (self._made, [".py"])).find_spec(name)
                if found is not None and found.loader is not None:
                    return found
        return None


def _root(file: Path) -> Path:
    """The folder from which a file is imported: its own, or that of the outermost package it is in."""
    home, root = run_around(file), file.parent
    while (root / "__init__.py").is_file() and root.parent not in (root, home):
        root = root.parent
    return root


def _imported(file: Path) -> tuple[ModuleType, dict[Path, str]]:
    root, seen = _root(file), dict[Path, str]()
    agreed = trusted(file, root)
    dotted = ".".join(file.relative_to(root).with_suffix("").parts)
    where = hashlib.sha256(str(file).encode()).hexdigest()[:8]  # compiled code that is kept knows it by its name
    name = dotted if "." in dotted else f"{_PREFIX}{dotted}_{where}"
    others = _set_aside(root, name.partition(".")[0])
    finder = _Beside(root, name, file, seen, agreed)
    sys.meta_path.insert(0, finder)
    try:
        module = import_module(name)
    except UserError:
        raise
    except (Exception, SystemExit) as error:
        what = f"{file.name} cannot be loaded: {type(error).__name__}: {error}"
        raise UserError(what, _place(error, seen), "mend it there; --debug shows the traceback") from error
    finally:
        sys.meta_path.remove(finder)
        sys.modules.update(others)
    return module, seen


def _set_aside(root: Path, package: str) -> dict[str, ModuleType]:
    """Take modules out of the way that have a name of what stands beside a file and were loaded from elsewhere, or
    before it was changed; of what is installed only the package of which this is a copy. Those to be put back."""
    names = {each.stem for each in root.iterdir()} - {"wristctl"}
    installed_at = [sysconfig.get_path(each) for each in ("stdlib", "platstdlib", "purelib", "platlib")]
    others: dict[str, ModuleType] = {}
    for known, module in list(sys.modules.items()):
        top, place = known.partition(".")[0], getattr(module, "__file__", None)
        there = place and any(Path(place).is_relative_to(each) for each in installed_at)
        if top == package or (top in names and place and not there):
            del sys.modules[known]
            if not isinstance(getattr(module, "__loader__", None), _Source):
                others[known] = module
    return others


def _place(error: BaseException, seen: Mapping[Path, str]) -> str:
    """The line of the sources in which it happened."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}:{error.lineno}"
    places = [f"{each.filename}:{each.lineno}" for each in traceback.extract_tb(error.__traceback__)]
    own = [each for each in places if Path(each.rpartition(":")[0]) in seen]
    return (own or places)[-1]
