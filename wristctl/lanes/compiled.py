"""`compiled`: numba's njit with this project's settings and a cache in the user's own cache folder.

numba renews a cached function when its own file changes, but not when a function that it calls does. So the cache
folder's name holds a hash of every source file that compiled code may rest on: other sources, another folder.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

_KEPT_DAYS = 30.0
_ABOVE = {"cli", "report", "comparison", "tuning", "records"}
"""Packages that compiled code does not rest on."""


@cache
def cache_folder() -> Path | None:
    """Folder of compiled kernels, or None where none can be written (then every process compiles anew)."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        if source.relative_to(package).parts[0] not in _ABOVE:
            digest.update(source.read_bytes())
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wristctl" / "kernels"
    folder = base / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            os.utime(folder)
        _forget_old(base, folder)
    except OSError:
        return None
    return folder


def _forget_old(base: Path, current: Path) -> None:
    for folder in base.iterdir():
        if folder != current and time.time() - folder.stat().st_mtime > _KEPT_DAYS * 86400.0:
            shutil.rmtree(folder, ignore_errors=True)


def compiled(function: F) -> F:
    """Compile for lanes: cached, without the interpreter's lock, without fast-math."""
    folder = cache_folder()
    if folder is not None:
        numba.config.CACHE_DIR = str(folder)
    jit = numba.njit(error_model="numpy", nogil=True, forceinline=True, cache=folder is not None)
    return cast(F, jit(function))
