"""Work of a worker: show once that it computes the same as the others, then compute units."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.errors import UserError
from wristctl.records.files import check_plain
from wristctl.records.formats import read_arrays, write_arrays
from wristctl.records.lock import locked
from wristctl.records.provenance import tree_digest
from wristctl.version import __version__

if TYPE_CHECKING:
    import numpy as np


# Folder of a run that holds its units.
UNITS = "units"
# Array in a unit's file that names the unit.
_KEY = "key"


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
    """Weight of the unit in the progress."""

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
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def file_of(folder: Path, key: str) -> Path:
    """File of the unit with this key."""
    return folder / f"{key}.npz"


def write_unit(folder: Path, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Keep what a unit gave, whole or not at all. UserError where the disk refuses."""
    import numpy as np

    write_arrays(file_of(folder, key), {**arrays, _KEY: np.array(key)})


def read_unit(folder: Path, key: str) -> dict[str, np.ndarray] | None:
    """Arrays of a unit. None if its file is missing, damaged (zip checksum of each array) or of another unit.

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
    stored_key = arrays.pop(_KEY, None)
    return arrays if stored_key is not None and str(stored_key) == key else None


def same_arrays(one: Mapping[str, np.ndarray], another: Mapping[str, np.ndarray]) -> bool:
    """Whether two sets of arrays are the same, to the bit."""
    return one.keys() == another.keys() and all(_bits(one[name]) == _bits(another[name]) for name in one)


def _bits(array: np.ndarray) -> tuple[str, tuple[int, ...], bytes]:
    import numpy as np

    return array.dtype.str, np.shape(array), np.ascontiguousarray(array).tobytes()


# Lock under which threads of a worker compile one after the other.
_ONE = threading.Lock()
_passed: set[tuple[str, str]] = set()


class Golden(NamedTuple):
    """Numbers that every worker must be able to compute: a function of a specification that gives their hash.

    What it runs is compiled then, so that no unit waits for it.
    """

    does: str
    spec: Mapping[str, Any]
    expected: str
    version: str
    code: str

    @classmethod
    def here(cls, does: str, spec: Mapping[str, Any]) -> Golden:
        """As this process computes them."""
        return cls(does, spec, str(function_at(does)(spec)), __version__, code_digest())


class Furnish(NamedTuple):
    """Preparation of a worker before all units, such as loading laws from outside the package."""

    does: str
    spec: Mapping[str, Any]


class Computed(NamedTuple):
    """Arrays of a unit, its host, and its wall time and processor time [s]."""

    arrays: dict[str, np.ndarray]
    host: str
    seconds: float
    processor: float


class WorkerDiffers(Exception):
    """A worker that would compute other numbers."""


def compute(does: str, spec: Mapping[str, Any], golden: Golden | None, furnish: Furnish | None = None) -> Computed:
    """Compute a unit. Raises WorkerDiffers before, where this worker is not of the same code or numbers."""
    host = platform.node()
    if furnish is not None:
        _furnish(furnish)
    if golden is not None and (golden.expected, golden.code) not in _passed:
        # workers of one machine take turns, so that the first compiles for all
        with _ONE, locked(Path(tempfile.gettempdir()) / f"wristctl-golden-{os.getuid()}.lock"):
            _check(golden, host)
    start, processor = time.perf_counter(), time.process_time()
    try:
        arrays = function_at(does)(spec)
    except Exception as error:
        error.add_note(f"on {host}")
        raise
    return Computed(arrays, host, time.perf_counter() - start, time.process_time() - processor)


def _furnish(furnish: Furnish) -> None:
    """Once in a process."""
    job = furnish.does, json.dumps(furnish.spec, sort_keys=True)
    with _ONE:
        if job not in _passed:
            function_at(furnish.does)(furnish.spec)
            _passed.add(job)


def _check(golden: Golden, host: str) -> None:
    """Compare what this process is and what it computes; it is not asked again."""
    if (golden.version, golden.code) != (__version__, code_digest()):
        same = "of the same number and other files" if golden.version == __version__ else f"{golden.version} here"
        raise WorkerDiffers(f"the worker on {host} runs wristctl {__version__}, {same}")
    try:
        digest = str(function_at(golden.does)(golden.spec))
    except Exception as error:  # a full disk, say: whatever it did would fail, and be blamed on the units
        problem = f"the worker on {host} cannot compute the golden rollout: {type(error).__name__}: {error}"
        raise WorkerDiffers(problem) from error
    if digest != golden.expected:
        numbers = f"its golden rollout is {digest[:12]} and not {golden.expected[:12]}"
        raise WorkerDiffers(f"the worker on {host} ({platform.machine()}) computes other numbers: {numbers}")
    _passed.add((golden.expected, golden.code))
