"""A unit of work: a pure function, by its place, of a specification; and the file that keeps what it gave.

What a unit gives depends on its specification (seeds and ranges of worlds included) and on the code alone, so a file
that was written once can stand in for the computation: wherever it ran, in whatever order, however often it was tried.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl.config.errors import UserError
from wristctl.records.code import tree_digest
from wristctl.records.formats import read_arrays, write_arrays

if TYPE_CHECKING:
    import numpy as np

UNITS = "units"
"""The folder of a run that holds them."""
_SEAL = "sha256"


@dataclass(frozen=True)
class Unit:
    """A piece of work: what it does, as `package.module:function`, and the specification that this is called with.

    The function gives arrays by name; the specification is what JSON can hold.
    """

    does: str
    spec: Mapping[str, Any]
    name: str = ""
    """In words, for people."""
    size: int = 1
    """How much work it is beside others, for the progress."""

    @cached_property
    def key(self) -> str:
        """SHA-256 of what it does, its specification and the code; its file is called so."""
        content = {"code": code_digest(), "does": self.does, "spec": self.spec}
        return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


@cache
def code_digest() -> str:
    """One hash over the files of the package as it runs; taken once, since what is imported stays as it was."""
    return tree_digest()


def function_at(place: str) -> Callable[..., Any]:
    """The function at `package.module:name`."""
    module, _, name = place.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found


def file_of(folder: Path, key: str) -> Path:
    """Where the unit of this key is kept."""
    return folder / f"{key}.npz"


def write_unit(folder: Path, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Keep what a unit gave, whole or not at all. UserError where the disk refuses."""
    import numpy as np

    write_arrays(file_of(folder, key), {**arrays, _SEAL: np.array(_seal(key, arrays))})


def read_unit(folder: Path, key: str) -> dict[str, np.ndarray] | None:
    """What a unit gave; None where it is not there, or not as it was written."""
    file = file_of(folder, key)
    try:
        arrays = read_arrays(file)
    except (OSError, UserError):
        return None
    sealed = arrays.pop(_SEAL, None)
    return arrays if sealed is not None and str(sealed) == _seal(key, arrays) else None


def take_over(source: Path, folder: Path, key: str) -> dict[str, np.ndarray] | None:
    """What a unit gave in another run, whose file is linked into this one; None where it is not there or not whole."""
    arrays = read_unit(source, key)
    if arrays is not None:
        try:
            os.link(file_of(source, key), file_of(folder, key))
        except FileExistsError:
            pass
        except OSError:  # another disk, or one without links
            shutil.copyfile(file_of(source, key), file_of(folder, key))
    return arrays


def _seal(key: str, arrays: Mapping[str, np.ndarray]) -> str:
    import numpy as np

    digest = hashlib.sha256(key.encode())
    for name in sorted(arrays):
        each = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {each.dtype.str} {np.shape(arrays[name])} ".encode())
        digest.update(each.tobytes())
    return digest.hexdigest()
