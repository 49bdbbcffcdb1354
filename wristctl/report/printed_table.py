"""Results as text: aligned tables for people, plain values for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from wristctl.config.printable import printable


@dataclass(frozen=True)
class Table:
    """A titled table; units stand in the column names. Cells are text, numbers, booleans or None."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def text(self, width: int | None = None) -> str:
        """Aligned columns, numbers to four digits; columns beyond `width` go below, the first repeated."""
        heads = [printable(each) for each in self.columns]
        rows = [[_plain(value) for value in row] for row in self.rows]
        cells = [[_cell(value) for value in row] for row in rows]
        widths = [max(map(len, column)) for column in zip(heads, *cells, strict=True)]
        right = [_numeric([row[at] for row in rows]) for at in range(len(self.columns))]

        def line(values: Sequence[str], chosen: Sequence[int]) -> str:
            padded = [values[at].rjust(widths[at]) if right[at] else values[at].ljust(widths[at]) for at in chosen]
            return "  ".join(padded).rstrip()

        blocks = []
        for chosen in _blocks(widths, width):
            rule = "  ".join("-" * widths[at] for at in chosen)
            blocks.append("\n".join([line(heads, chosen), rule, *(line(row, chosen) for row in cells)]))
        return "\n".join([printable(self.title), ""] * bool(self.title) + ["\n\n".join(blocks)])


def number(value: float) -> str:
    """Four significant digits; infinities and NaN as a dash."""
    return f"{value:.4g}" if math.isfinite(value) else "-"


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str | int):
        return printable(value)
    return number(float(value))


def _numeric(column: Sequence[Any]) -> bool:
    return not any(isinstance(value, str | bool) for value in column)


def _blocks(widths: Sequence[int], width: int | None) -> list[list[int]]:
    """Which columns stand beside each other: the first everywhere, the others as far as `width` reaches."""
    blocks, used = [[0]], widths[0]
    for at in range(1, len(widths)):
        if width is not None and at > 1 and used + 2 + widths[at] > width:
            blocks.append([0])
            used = widths[0]
        blocks[-1].append(at)
        used += 2 + widths[at]
    return blocks
