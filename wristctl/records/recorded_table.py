"""Columns of a recording as its file has them, before they are named: the common form of every format that is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.errors import UserError

Cells = Sequence[str] | np.ndarray[Any, Any]
"""A column: texts as they stand in the file, or numbers, dates or texts of numpy (T,)."""
INSTALL = "pip install 'wristctl[logs]'"
"""What installs the libraries that read logs in binary formats."""


def cannot_read(what: str, file: Path, error: Exception, fix: str = "check the path") -> UserError:
    """The user's error of a recording that its reader refuses."""
    return UserError(f"cannot read the {what}: {getattr(error, 'strerror', None) or error}", str(file), fix)


def line_of(file: Path, lines: Sequence[int], row: int) -> str:
    """File and line of a row, for messages; the file alone of a binary one, which has no lines."""
    return f"{file}:{lines[row]}" if lines else str(file)


@dataclass(frozen=True)
class RigidBody:
    """Poses of a rigid body, a marker cluster or an inertial unit at T times, in the axes of the laboratory."""

    time: Array
    """(T,) [s]"""
    turn: Array
    """Orientation as unit quaternions x, y, z, w (T, 4); nan where it was lost."""
    place: Array | None
    """Position (T, 3) [m]; None of what has an orientation alone."""
    rows: NDArray[np.intp]
    """Row of the table of each time (T,)."""
    since: int | None = None
    """Row of the table from whose pose the orientation counts; None: from axes of its own."""


def unit_quaternions(turn: Array) -> Array:
    """Quaternions (T, 4) of norm 1; nan where one is no orientation."""
    size = np.linalg.norm(turn, axis=1, keepdims=True)
    return np.where(size > 0.5, turn / np.where(size > 0.5, size, 1.0), np.nan)


@dataclass(frozen=True)
class RecordedTable:
    """Columns by their place, a head for each."""

    heads: Sequence[str]
    """Names, with units in brackets where the file has them."""
    cells: Sequence[Cells]
    lines: Sequence[int] = ()
    """Line of the file of each row; empty of a binary file."""
    header_line: int = 0
    """Line of the header; 0 of a binary file."""
    remarks: Sequence[str] = ()
    """What was passed over or read in another way, a sentence each."""
    bodies: Mapping[str, RigidBody] = field(default_factory=dict)
    """Rigid bodies by their names."""
    others: bool = False
    """Whether columns that an open log does not have are passed over, since those that it has stand under its names."""


@dataclass(frozen=True)
class LogFormat:
    """Text that another program writes: an entry of `wristctl.config.choices.LOG_FORMATS`."""

    what: str
    """Description of the files, for a list."""
    begins: Callable[[str], bool]
    """Whether a file is of this format, by its first line that is not blank."""
    read: Callable[[str, Path], RecordedTable]
    """Columns and rigid bodies of a text; the file is for errors. Raises UserError where it has none."""
