"""numba's njit with this project's settings, and a cache in the user's own cache folder for what Python calls.

numba renews a cached function when its own file changes, but not when a function that it calls does. So the cache
folder's name holds a hash of the file and of all files that it imports, theirs too: other sources, another folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast

import numba
from numba.core.registry import CPUDispatcher
from numba.extending import overload

from wristctl.lanes.kernel_folder import kernels_folder

F = TypeVar("F", bound=Callable[..., Any])

TRIED = "0.68"
"""The numba that the tests ran with. What lanes are built on (docs/lanes.md) may be another thing in the next one."""

_KEPT_DAYS = 30.0
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "forceinline": True}
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Of what compiled code alone calls: a way in from Python would be compiled for each of them, and never used."""
_PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(rb"^(?:from|import) +([\w.]+)", re.MULTILINE)
_CONSTANT_FREE = ("wristctl.config", "wristctl.records")
"""Packages that compiled code takes nothing from, neither a function nor a number."""

if not numba.__version__.startswith(f"{TRIED}."):
    told = f"numba {numba.__version__}: wristctl was tried with {TRIED} only; pip install 'numba=={TRIED}.*'"
    warnings.warn(told, stacklevel=2)


@cache
def _read(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """The content of a source file, and the files beside or in this package that it imports at its top."""
    content = file.read_bytes()
    found = []
    for module in sorted({each.decode() for each in _IMPORT.findall(content)}):
        inside = module.startswith("wristctl.") and not module.startswith(_CONSTANT_FREE)
        stem = (_PACKAGE.parent if inside else file.parent).joinpath(*module.split("."))
        if inside or not module.startswith("wristctl"):
            found += [each for each in (stem.with_suffix(".py"), stem / "__init__.py") if each.is_file()]
    return content, tuple(found)


def sources(file: Path) -> list[Path]:
    """The file and every file that it rests on, sorted: those that it imports and those that they import."""
    reached, waiting = {file}, [file]
    while waiting:
        for each in _read(waiting.pop())[1]:
            if each not in reached:
                reached.add(each)
                waiting.append(each)
    return sorted(reached)


@cache
def cache_folder(file: Path, *others: Path, frozen: bytes = b"") -> Path | None:
    """Folder for what is compiled of these source files, or None where none can be written: then nothing is kept.

    `frozen` stands for what decides it beside them.
    """
    if not file.is_file():  # typed into a notebook
        return None
    digest = hashlib.sha256(numba.__version__.encode() + frozen)
    for source in sorted({each for root in (file, *others) for each in sources(root)}):
        digest.update(_read(source)[0])
    try:
        folder = _kernels() / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            os.utime(folder)
    except (OSError, RuntimeError):  # RuntimeError: the user has no home
        return None
    return folder


@cache
def _kernels() -> Path:
    base = kernels_folder()
    if base.is_dir():
        for folder in base.iterdir():
            if time.time() - folder.stat().st_mtime > _KEPT_DAYS * 86400.0:
                shutil.rmtree(folder, ignore_errors=True)
    return base


@contextmanager
def caching(file: Path, *others: Path, frozen: bytes = b"") -> Iterator[bool]:
    """Within the block numba caches what these source files define where it belongs; yields whether it can.

    numba takes its folder from a setting of the whole process, when a function is decorated: it is put back at once.
    """
    folder, before = cache_folder(file, *others, frozen=frozen), numba.config.CACHE_DIR
    if folder is not None:
        numba.config.CACHE_DIR = str(folder)
    try:
        yield folder is not None
    finally:
        numba.config.CACHE_DIR = before


class _Inner(CPUDispatcher):
    """A function without a way in from Python, where numba would jump to nowhere."""

    def __call__(self, *_: Any) -> NoReturn:
        raise TypeError(f"{self.__name__} is for compiled code: call it in a @kernel")


def _inner(function: F, **options: Any) -> F:
    made = numba.njit(**_OPTIONS, **_INNER, **options)(function)
    made.__class__ = _Inner
    return cast(F, made)


def compiled(function: F) -> F:
    """Compile for code that is compiled: inlined where it is called, and kept with what calls it."""
    return _inner(function)


def spelled_out(function: F) -> F:
    """Like `compiled`, its body copied to where it is called before any compiling.

    For what is called once and holds almost all of its caller: that is then compiled one time less.
    """
    return _inner(function, inline="always")


_BODIES: dict[tuple[Any, Any], Any] = {}
"""Bodies of functions by the function that declares them and the NamedTuple class of the first argument."""


def by_type(function: F) -> F:
    """Declare a function of compiled code whose body follows from the type of its first argument.

    `implements` gives the body for a NamedTuple class. So a part that is absent is a class without fields, and no more
    is compiled than what a loop has.
    """

    @overload(function, strict=False, jit_options=_OPTIONS)
    def body(part: Any, *others: Any) -> Any:
        return _BODIES.get((function, getattr(part, "instance_class", None)))

    return function


def implements(declared: Any, *kinds: Any) -> Callable[[F], F]:
    """Make a function the body of a declared one (`by_type`) for these NamedTuple classes of its first argument."""

    def keep(function: F) -> F:
        for kind in kinds:
            _BODIES[declared, kind] = getattr(function, "py_func", function)
        return function

    return keep


def kernel(function: F, *others: Path) -> F:
    """Compile for Python, which calls it, and keep it in the cache.

    `others` are source files beside the function's own that decide what it does, where it does not import them.
    """
    with caching(Path(function.__code__.co_filename), *others) as cached:
        return cast(F, numba.njit(cache=cached, **_OPTIONS)(function))
