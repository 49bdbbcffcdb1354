"""numba's njit with this project's settings, and a cache in the user's own cache folder for what Python calls.

numba renews a cached function when its own file changes, but not when a function that it calls does. So the cache
folder's name holds a hash of the file and of all files that it imports, theirs too: other sources, another folder.
Where the package lies is no part of it: checkouts, copies and installed packages of the same sources share a cache.
"""

import fcntl
import hashlib
import os
import pickle
import re
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial, wraps
from inspect import unwrap
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NoReturn, TypeVar, cast

import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.registry import CPUDispatcher
from numba.extending import overload

from wristctl.lanes.compile_time import COMPILE_TIME
from wristctl.lanes.kernel_folder import kernels_folder, own_folder

_PACKAGE = Path(__file__).resolve().parents[1]


def frozen_values(function: Callable[..., Any]) -> tuple[bytes, tuple[Path, ...]]:
    """A hash over all that a function reaches outside this package, and the files of this package that it reaches.

    It reaches globals by the names in its code, attributes of modules too, and what its closure holds.
    """
    digest, files, visited = hashlib.sha256(), set[Path](), set[int]()
    waiting: list[Any] = [function]
    while waiting:
        value = waiting.pop()
        unwrapped = unwrap(getattr(value, "py_func", getattr(value, "_defn", value)))
        if not isinstance(unwrapped, FunctionType):
            digest.update(_told(value))
        elif id(unwrapped) not in visited:
            visited.add(id(unwrapped))
            file = Path(unwrapped.__code__.co_filename)
            if file.is_relative_to(_PACKAGE):
                files.add(file)
                continue
            digest.update(unwrapped.__qualname__.encode())
            for code in _codes(unwrapped.__code__):
                digest.update(code.co_code + repr((code.co_names, code.co_varnames, _plain(code.co_consts))).encode())
                waiting += _reached(unwrapped, code)
            waiting += [cell.cell_contents for cell in unwrapped.__closure__ or ()]
            waiting += [*(unwrapped.__defaults__ or ()), *(unwrapped.__kwdefaults__ or {}).values()]
    return digest.digest(), tuple(sorted(files))


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A function's code, and that of the functions within it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _plain(constants: tuple[Any, ...]) -> list[Any]:
    return [constant for constant in constants if not isinstance(constant, CodeType)]


def _reached(function: FunctionType, code: CodeType) -> Iterator[Any]:
    """Values that the names in a code stand for: globals, and attributes of the modules among them."""
    named = {name: function.__globals__[name] for name in code.co_names if name in function.__globals__}
    for name in sorted(named):
        value = named[name]
        if isinstance(value, ModuleType):
            yield from (getattr(value, attribute) for attribute in sorted(code.co_names) if hasattr(value, attribute))
        else:
            yield value


def _told(value: Any) -> bytes:
    """A value as bytes that are the same in another process; what has none is told by where it is, and never kept."""
    if isinstance(value, np.ndarray):
        return repr((value.shape, value.dtype)).encode() + np.ascontiguousarray(value).tobytes()
    if isinstance(value, ModuleType):
        return value.__name__.encode()
    try:
        return pickle.dumps(value)
    except Exception:
        return repr(value).encode()


F = TypeVar("F", bound=Callable[..., Any])

# The numba that the tests ran with. What lanes are built on (docs/lanes.md) may be another thing in the next one.
TRIED = "0.68"

_KEPT_DAYS = 30.0
# Longest wait [s] for another process that compiles the same, and pause between two looks at its lock.
_PATIENCE, _PAUSE = 120.0, 0.05
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "forceinline": True}
# Options of functions that compiled code alone calls: a way in from Python would be compiled and never used.
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_IMPORT = re.compile(rb"^(?:from|import) +([\w.]+)", re.MULTILINE)
# Packages that compiled code takes nothing from, neither a function nor a number.
_CONSTANT_FREE = tuple(f"wristctl.{room}" for room in ("config", "errors", "plugins", "records", "study_files"))

if not numba.__version__.startswith(f"{TRIED}."):
    warning = f"numba {numba.__version__}: wristctl was tried with {TRIED} only; pip install 'numba=={TRIED}.*'"
    warnings.warn(warning, stacklevel=2)


@cache
def _read(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """The content of a source file, and the files beside or in this package that it imports at its top."""
    content = file.read_bytes()
    imported = []
    for module in sorted({name.decode() for name in _IMPORT.findall(content)}):
        inside = module.startswith("wristctl.") and not module.startswith(_CONSTANT_FREE)
        stem = (_PACKAGE.parent if inside else file.parent).joinpath(*module.split("."))
        if inside or not module.startswith("wristctl"):
            imported += [path for path in (stem.with_suffix(".py"), stem / "__init__.py") if path.is_file()]
    return content, tuple(imported)


def _named(source: Path) -> str:
    """A source file's name in a hash: below the package, or the whole path of what lies elsewhere."""
    place = source.resolve()
    return place.relative_to(_PACKAGE).as_posix() if place.is_relative_to(_PACKAGE) else str(place)


def sources(file: Path) -> list[Path]:
    """The file and every file that it rests on, sorted: those that it imports and those that they import."""
    reached, waiting = {file}, [file]
    while waiting:
        for imported in _read(waiting.pop())[1]:
            if imported not in reached:
                reached.add(imported)
                waiting.append(imported)
    return sorted(reached)


@cache
def cache_folder(file: Path, *extra_sources: Path, frozen: bytes = b"") -> Path | None:
    """Folder for what is compiled of these source files, or None where none can be written: then nothing is kept.

    `frozen` stands for what decides it beside them.
    """
    if not file.is_file():  # typed into a notebook
        return None
    digest = hashlib.sha256(repr((numba.__version__, frozen, _named(file))).encode())
    for source in sorted({path for root in (file, *extra_sources) for path in sources(root)}, key=_named):
        digest.update(repr((_named(source), _read(source)[0])).encode())
    try:
        base = _kernels()
        folder = base and base / digest.hexdigest()[:16]
        if folder is None or not own_folder(folder):
            return None
        with tempfile.TemporaryFile(dir=folder):
            os.utime(folder)
    except (OSError, RuntimeError):  # RuntimeError: the user has no home
        return None
    return folder


@cache
def _kernels() -> Path | None:
    base = kernels_folder()
    for folder in base.iterdir() if base else ():
        if time.time() - folder.stat().st_mtime > _KEPT_DAYS * 86400.0:
            shutil.rmtree(folder, ignore_errors=True)
    return base


class _Kept(FunctionCache):
    """numba's cache of one function, in a folder that it is given.

    numba's own takes the folder from a setting of the whole process, and adds where the sources lie.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._impl_class = partial(_KeptFiles, folder=folder)
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Index(str(folder), self._impl.filename_base, stamp)


class _Index(IndexDataCacheFile):
    """numba's index of what is kept of one function: a file for each signature, which it numbers.

    Of processes that keep two signatures at once each has a number of its own: numba lets them write one file, and runs
    the one's code with the other's arguments (numba issue 4807).
    """

    def save(self, key: Any, data: Any) -> None:
        with _alone(Path(f"{self._index_path}.lock")):
            super().save(key, data)


class _KeptFiles(CompileResultCacheImpl):
    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._locator, self._lineno = _Locator(function, folder), function.__code__.co_firstlineno
        name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}"
        self._filename_base = self.get_filename_base(name, sys.abiflags)


class _Locator(UserProvidedCacheLocator):
    """Locator of a function's files; their stamp is the hash of its source file."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        code = function.__code__
        self._py_file, self._lineno, self._cache_path = code.co_filename, code.co_firstlineno, str(folder)


def kept_nowhere(function: F) -> F:
    """A function that encloses others, which are no part of its source: nothing that is compiled of it is kept."""
    function.__code__ = function.__code__.replace(co_filename="<made>")
    return function


def keep(dispatcher: Any, function: Callable[..., Any], *extra_sources: Path, frozen: bytes = b"") -> Path | None:
    """Have what numba makes of a function, a dispatcher or a C function, kept in the folder of its sources."""
    folder = cache_folder(Path(function.__code__.co_filename), *extra_sources, frozen=frozen)
    if folder is not None:
        dispatcher._cache = _Kept(function, folder)
    return folder


class _Kernel(CPUDispatcher):
    """A function that Python calls: of processes that need it at once one compiles, the others take what it kept."""

    kept: Path | None
    """Folder of what is compiled, or None."""

    def compile(self, sig: Any) -> Any:
        signature = hashlib.sha256(str(sig).encode()).hexdigest()[:16]
        lock = self.kept and self.kept / f"{self.py_func.__qualname__}.{signature}.lock"
        with COMPILE_TIME.counted(), _alone(lock):
            return super().compile(sig)


@contextmanager
def _alone(file: Path | None) -> Iterator[None]:
    """Hold a lock file; without it where it cannot be written, or where another process holds it for too long."""
    try:
        lock = file.open("a") if file else None
    except OSError:
        lock = None
    if lock is None:
        yield
        return
    with lock:
        last = time.monotonic() + _PATIENCE
        while time.monotonic() < last:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(_PAUSE)
            except OSError:
                break
        yield


class _Inner(CPUDispatcher):
    """A function without a way in from Python, where numba would jump to nowhere."""

    def __call__(self, *_: Any) -> NoReturn:
        raise TypeError(f"{self.__name__} is for compiled code: call it in a @kernel")


def _inner(function: F, **options: Any) -> F:
    dispatcher = numba.njit(**_OPTIONS, **_INNER, **options)(function)
    dispatcher.__class__ = _Inner
    return cast(F, dispatcher)


def compiled(function: F) -> F:
    """Compile for code that is compiled: inlined where it is called, and kept with what calls it."""
    return _inner(function)


def spelled_out(function: F) -> F:
    """Like `compiled`, its body copied to where it is called before any compiling.

    For what is called once and holds almost all of its caller: that is then compiled one time less.
    """
    return _inner(function, inline="always")


# Bodies of functions by the function that declares them and the NamedTuple class of the first argument.
_BODIES: dict[tuple[Any, Any], Any] = {}


def by_type(function: F) -> F:
    """Declare a function of compiled code whose body follows from the type of its first argument.

    `implements` gives the body for a NamedTuple class. So a part that is absent is a class without fields, and no more
    is compiled than what a loop has.
    """

    @wraps(function)
    def declared(*_: Any) -> NoReturn:
        raise NotImplementedError("compiled code only")

    @overload(declared, strict=False, jit_options=_OPTIONS)
    def body(part: Any, *others: Any) -> Any:
        return _BODIES.get((declared, getattr(part, "instance_class", None)))

    return cast(F, declared)


def implements(declared: Any, *kinds: Any) -> Callable[[F], F]:
    """Make a function the body of a declared one (`by_type`) for these NamedTuple classes of its first argument."""

    def keep(function: F) -> F:
        for kind in kinds:
            _BODIES[declared, kind] = getattr(function, "py_func", function)
        return function

    return keep


def nothing(part: Any, *others: Any) -> None:
    """Body of what an absent part does."""


def itself(part: Any) -> Any:
    """Body of what gives the part as it is."""
    return part


def kernel(function: F, *extra_sources: Path) -> F:
    """Compile for Python, which calls it, and keep it in the cache.

    `extra_sources` are files beside the function's own that decide what it does, where it does not import them.
    """
    dispatcher = numba.njit(**_OPTIONS)(function)
    dispatcher.__class__ = _Kernel
    dispatcher.kept = keep(dispatcher, function, *extra_sources)
    return cast(F, dispatcher)
