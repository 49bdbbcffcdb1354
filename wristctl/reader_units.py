"""Units that people read: angles, which files have in radians, in degrees."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

# Units of angles in files, and what people read.
_DEGREES = {"rad": "deg", "rad s": "deg s"}
_NUMBER = r"-?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?"
_IN_WORDS = re.compile(rf"{_NUMBER}(?: to {_NUMBER})?")


# Size below which a number is what rounding has left of 0.
_DUST = 1e-30


def without_dust(value: float) -> float:
    """The value, or 0 without a sign where it is smaller than anything that is meant."""
    return 0.0 if abs(value) < _DUST else value


def in_degrees(value: Any, unit: str) -> tuple[Any, str]:
    """A number, also in words, or a range of two, and its unit for people: angles, and their integrals, in degrees.

    A whole number is a count and no angle.
    """
    if unit not in _DEGREES:
        return value, unit
    if isinstance(value, str) and _IN_WORDS.fullmatch(value):
        return " to ".join(format(math.degrees(float(end)), ".4g") for end in value.split(" to ")), _DEGREES[unit]
    return (math.degrees(value) if isinstance(value, float) else value), _DEGREES[unit]


def readable(columns: Sequence[Any], rows: Sequence[Sequence[Any]]) -> tuple[list[str], list[list[Any]]]:
    """Heads and rows of a table with angles in degrees.

    These are the columns whose head says `[rad]`, and the rows that have this unit in a column `unit`.
    """
    heads, shown = [str(head) for head in columns], [list(row) for row in rows]
    unit_at = heads.index("unit") if "unit" in heads else None
    for at, head in enumerate(heads):
        name, _, unit = head.removesuffix("]").rpartition("[")
        if head.endswith("]") and unit in _DEGREES:
            heads[at] = f"{name}[{_DEGREES[unit]}]"
            for row in shown:
                row[at] = in_degrees(row[at], unit)[0]
    for row in shown:
        if unit_at is not None and row[unit_at] in _DEGREES:
            row[1:] = [in_degrees(cell, row[unit_at])[0] for cell in row[1:]]  # the first is a name
            row[unit_at] = _DEGREES[row[unit_at]]
    return heads, shown


def metric_in_words(name: str, unit: str = "") -> str:
    """Name of a metric for people, without the unit that stands beside it: `tip_rmse_mm` [mm] is `tip RMSE`."""
    words = name.removesuffix(f"_{unit}").replace("_", " ")
    return re.sub(r"\brmse\b", "RMSE", re.sub(r"^r2$", "R^2", words))
