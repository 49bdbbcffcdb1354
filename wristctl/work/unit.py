"""A unit of work: a pure function, by its place, of a specification; and the file that keeps what it gave.

What a unit gives depends on its specification (seeds and ranges of worlds included) and on the code alone, so a file
that was written once can stand in for the computation: wherever it ran, in whatever order, however often it was tried.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl.config.errors import UserError
from wristctl.records.code import tree_digest
from wristctl.records.files import check_plain
from wristctl.records.formats import read_arrays, write_arrays

if TYPE_CHECKING:
    import numpy as np

UNITS = "units"
"""The folder of a run that holds them."""
_KEY = "key"
"""The array of a unit's file that says whose it is."""


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

    write_arrays(file_of(folder, key), {**arrays, _KEY: np.array(key)})


def read_unit(folder: Path, key: str) -> dict[str, np.ndarray] | None:
    """What a unit gave; None where it is not there, damaged (a zip has a checksum of each array), or another's.

    UserError where a link or something else that is no plain file stands in its place.
    """
    file = file_of(folder, key)
    if not os.path.lexists(file):
        return None
    check_plain(file)
    try:
        arrays = read_arrays(file)
    except (OSError, UserError):
        return None
    known = arrays.pop(_KEY, None)
    return arrays if known is not None and str(known) == key else None


def same_arrays(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> bool:
    """Whether two sets of arrays are the same, to the bit."""
    return one.keys() == other.keys() and all(_bits(one[name]) == _bits(other[name]) for name in one)


def _bits(array: np.ndarray) -> tuple[str, tuple[int, ...], bytes]:
    import numpy as np

    return array.dtype.str, np.shape(array), np.ascontiguousarray(array).tobytes()
