"""Sources from elsewhere: imported with the modules and data that stand beside them.

What is loaded is the text of the sources as it was hashed: bytecode and libraries beside them are never looked at.
"""

import hashlib
import os
import sys
import sysconfig
import traceback
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.machinery import FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import spec_from_loader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple

from wristctl.errors import UserError
from wristctl.interrupt import from_outside
from wristctl.plain_files import read_plain
from wristctl.plugins.trust import digest_now, run_around, trusted

_PREFIX = "wristctl_foreign_"


class _Import(NamedTuple):
    """Sources that are being imported: where they stand, the hash of each so far, and the agreed ones where one is."""

    root: Path
    seen: dict[Path, str]
    agreed: Mapping[Path, str] | None

    def note(self, file: Path, digest: str) -> None:
        """Take a file's hash. Raises UserError where it is not the agreed one."""
        if self.agreed is not None and self.agreed.get(file) != digest:
            raise UserError("the code of a run changed after it was shown", str(file), "look at it again")
        self.seen[file] = digest


# Imports under way, the innermost last.
_under_way: list[_Import] = []
_imported: set[Path] = set()


def data_file(source: str, name: str) -> Path:
    """A file beside a law that it reads while it is imported, such as a policy's weights: `data_file(__file__, NAME)`.

    It belongs to the law's sources then: hashed, copied into runs, shown before it is trusted. Raises UserError where
    it is not there, lies outside the folder of the sources, is not what was agreed to, or is asked for only later.
    """
    file = Path(os.path.abspath(Path(source).parent / name))
    if not file.is_file():
        problem = f"no file {name} beside {Path(source).name}"
        raise UserError(problem, str(file), "paths count from the controller's file")
    if _under_way:
        root = _under_way[-1].root
        if not file.resolve().is_relative_to(root.resolve()):
            raise UserError("a controller reads data from outside its folder", str(file), f"put it below {root}")
        _under_way[-1].note(file, digest_now(file))
    elif Path(source) in _imported and file not in _imported:
        problem = f"{name} is asked for when {Path(source).name} has been imported, and would not be kept with it"
        raise UserError(problem, source, "call data_file at the top of the file")
    return file


class _Source(SourceFileLoader):
    """Loads the text of a module itself, and has its hash noted."""

    def __init__(self, name: str, path: str, importing: _Import) -> None:
        super().__init__(name, path)
        self._importing = importing

    def get_code(self, fullname: str) -> CodeType:
        """Compiled from the source, never from bytecode."""
        file = Path(self.path)
        content = read_plain(file)
        self._importing.note(file, hashlib.sha256(content).hexdigest())
        code: CodeType = compile(content, self.path, "exec", dont_inherit=True)
        return code


class _Beside:
    """Finds the modules beside a file, before those of the same name elsewhere; the standard library comes first."""

    def __init__(self, name: str, file: Path, importing: _Import) -> None:
        self._folder, self._name, self._file = importing.root, name, file
        self._made: Any = lambda name, path: _Source(name, path, importing)

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: Any = None) -> ModuleSpec | None:
        """The module's, where it stands beside the file or within a package there."""
        if name == self._name and "." not in name:
            spec: ModuleSpec | None = spec_from_loader(name, self._made(name, str(self._file)))
            return spec
        if name.partition(".")[0] in sys.stdlib_module_names:
            return None
        for folder in [str(self._folder)] if path is None else list(path):
            if Path(folder).is_relative_to(self._folder):
                spec = FileFinder(folder, (self._made, [".py"])).find_spec(name)
                if spec is not None and spec.loader is not None:
                    return spec
        return None


sys.modules.setdefault("wristctl.config.sources", sys.modules[__name__])
"""Laws that earlier runs carry import `data_file` from there."""


def root_of(file: Path) -> Path:
    """The folder from which a file is imported: its own, or that of the outermost package it is in."""
    home, root = run_around(file), file.parent
    while (root / "__init__.py").is_file() and root.parent not in (root, home):
        root = root.parent
    return root


def imported(file: Path) -> tuple[ModuleType, dict[Path, str]]:
    """The module of a file, imported anew, and the hashes of what it was made from. UserError where it cannot be."""
    root = root_of(file)
    importing = _Import(root, {}, trusted(file, root))
    dotted = ".".join(file.relative_to(root).with_suffix("").parts)
    where = hashlib.sha256(str(file).encode()).hexdigest()[:8]  # compiled code that is kept knows it by its name
    name = dotted if "." in dotted else f"{_PREFIX}{dotted}_{where}"
    removed = _set_aside(root, name.partition(".")[0])
    finder = _Beside(name, file, importing)
    sys.meta_path.insert(0, finder)
    _under_way.append(importing)
    try:
        module = import_module(name)
    except BaseException as error:
        if isinstance(error, UserError) or from_outside(error):
            raise
        problem = f"{file.name} cannot be loaded: {type(error).__name__}: {error}"
        raise UserError(problem, _place(error, importing.seen), "mend it there; --debug shows the traceback") from error
    finally:
        _under_way.pop()
        sys.meta_path.remove(finder)
        sys.modules.update(removed)
    _imported.update(importing.seen)
    return module, importing.seen


def _set_aside(root: Path, package: str) -> dict[str, ModuleType]:
    """Take modules out of the way that have a name of what stands beside a file and were loaded from elsewhere, or
    before it was changed; of what is installed only the package of which this is a copy. Those to be put back."""
    names = {entry.stem for entry in root.iterdir()} - {"wristctl"}
    installed_at = [sysconfig.get_path(scheme) for scheme in ("stdlib", "platstdlib", "purelib", "platlib")]
    removed: dict[str, ModuleType] = {}
    for imported_name, module in list(sys.modules.items()):
        top, place = imported_name.partition(".")[0], getattr(module, "__file__", None)
        from_installation = place and any(Path(place).is_relative_to(folder) for folder in installed_at)
        if top == package or (top in names and place and not from_installation):
            del sys.modules[imported_name]
            if not isinstance(getattr(module, "__loader__", None), _Source):
                removed[imported_name] = module
    return removed


def _place(error: BaseException, sources: Mapping[Path, str]) -> str:
    """The line of the sources in which it happened."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}:{error.lineno}"
    places = [f"{frame.filename}:{frame.lineno}" for frame in traceback.extract_tb(error.__traceback__)]
    source_places = [place for place in places if Path(place.rpartition(":")[0]) in sources]
    return (source_places or places)[-1]
