"""Columns of a recording as its file has them, before they are named: the common form of every format that is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Cells = Sequence[str] | np.ndarray[Any, Any]
"""A column: texts as they stand in the file, or numbers, dates or texts of numpy (T,)."""
INSTALL = "pip install 'wristctl[logs]'"
"""What installs the libraries that read logs in binary formats."""


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
