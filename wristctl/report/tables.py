"""A comparison as a table: aligned text, a terminal's table, Markdown and CSV, from rows of values by key.

Numbers have as many significant digits as their column says; the paper's value stands beside ours.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Column:
    """The values of one key: heading, unit, significant digits, and how a missing number (nan) reads."""

    key: str
    head: str
    unit: str = ""
    digits: int = 3
    missing: str = "-"

    @property
    def title(self) -> str:
        """Heading with unit."""
        return f"{self.head} [{self.unit}]" if self.unit else self.head

    def cell(self, row: Row) -> str:
        """The row's value as text; a number that a diverged run does not have reads `diverged`."""
        value = row.get(self.key)
        if value is None:
            return "-"
        if isinstance(value, float) and math.isnan(value):
            return "diverged" if row.get("failed") and not self.key.startswith("paper_") else self.missing
        return significant(value, self.digits) if isinstance(value, float) else str(value)


COMPARISON = (
    Column("loop", "loop"),
    Column("reference", "reference"),
    Column("controller", "controller"),
    Column("gains", "gains"),
    Column("inverse", "inverse"),
    Column("rmse", "RMSE", "rad"),
    Column("paper_rmse", "paper", "rad"),
    Column("settling", "settling", "s", missing="never"),
    Column("paper_settling", "paper", "s"),
    Column("steady_state", "steady state", "rad"),
    Column("paper_steady_state", "paper", "rad"),
    Column("overshoot", "overshoot", "%", digits=2),
    Column("chattering", "chattering", "N/s", digits=2),
    Column("peak_tension", "peak tension", "N"),
    Column("verdict", "verdict"),
)
"""Columns of the rows of `wristctl.benchmark.compare.frame`."""


def significant(value: float, digits: int = 3) -> str:
    """A number with this many significant digits: 0.00123 and 45.6 as such, 2.7e-4 and 1.16e5 with an exponent."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    return f"{value:.{max(0, digits - 1 - power)}f}" if -3 <= power <= 3 else f"{mantissa}e{power}"


def text(rows: Sequence[Row], columns: Sequence[Column] = COMPARISON) -> str:
    """Aligned columns under their titles, numbers to the right."""
    cells = [[column.title for column in columns], *_cells(rows, columns)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    right = [_numeric(rows, column) for column in columns]
    lines = [[c.rjust(w) if r else c.ljust(w) for c, w, r in zip(line, widths, right, strict=True)] for line in cells]
    return "\n".join("  ".join(line).rstrip() for line in [lines[0], ["-" * w for w in widths], *lines[1:]])


def terminal(rows: Sequence[Row], columns: Sequence[Column] = COMPARISON, title: str = "") -> Table:
    """The same for a rich console, which fits it to the terminal."""
    from rich.table import Table

    made = Table(title=title or None, title_justify="left")
    for column in columns:
        made.add_column(column.title, justify="right" if _numeric(rows, column) else "left")
    for line in _cells(rows, columns):
        made.add_row(*line)
    return made


def markdown(rows: Sequence[Row], columns: Sequence[Column] = COMPARISON) -> str:
    """A Markdown table."""
    rule = ["---:" if _numeric(rows, column) else "---" for column in columns]
    lines = [[column.title for column in columns], rule, *_cells(rows, columns)]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def csv_text(rows: Sequence[Row], columns: Sequence[Column] = COMPARISON) -> str:
    """CSV with every digit, so that numbers read back exactly; what is missing is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([column.title for column in columns])
    for row in rows:
        values = [row.get(column.key) for column in columns]
        writer.writerow(["" if value is None or value != value else value for value in values])
    return out.getvalue()


def _cells(rows: Sequence[Row], columns: Sequence[Column]) -> list[list[str]]:
    return [[column.cell(row) for column in columns] for row in rows]


def _numeric(rows: Sequence[Row], column: Column) -> bool:
    """Whether the column holds numbers."""
    return any(isinstance(row.get(column.key), int | float) for row in rows)
