"""Import of matplotlib without the user's settings: a matplotlibrc decides no result, and a damaged one ends none.

matplotlib reads its settings while it is imported, from the working folder before any other place.
"""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

_BACKEND = "MPLBACKEND"


def use_defaults() -> None:
    """Let this process, which is wristctl's own, import matplotlib with its defaults."""
    if not any(isinstance(finder, _Defaults) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Defaults())


class _Defaults(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where matplotlib is, with a loader that reads no settings; None of any other module."""
        spec = PathFinder.find_spec(fullname, path, target) if fullname == "matplotlib" else None
        if spec is not None and spec.loader is not None and spec.origin is not None:
            load = partial(_load, spec.loader.exec_module, Path(spec.origin).parent / "mpl-data")
            spec.loader.exec_module = load  # type: ignore[method-assign]
        return spec


def _load(load: Callable[[ModuleType], None], defaults: Path, module: ModuleType) -> None:
    backend = os.environ.pop(_BACKEND, None)
    try:
        with _within(defaults):
            load(module)
    finally:
        if backend is not None:
            os.environ[_BACKEND] = backend


@contextmanager
def _within(folder: Path) -> Iterator[None]:
    """In a folder for the length of a block, then where it was before; not at all where there is no way back."""
    try:
        before = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    except OSError:
        yield
        return
    try:
        with suppress(OSError):
            os.chdir(folder)
        yield
    finally:
        os.fchdir(before)
        os.close(before)
