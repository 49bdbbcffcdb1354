"""Results as text: aligned tables for people, plain values for programs, and sentences in lines."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.escape import printable
from wristctl.reader_units import readable, without_dust

if TYPE_CHECKING:
    from wristctl.comparison.tie_groups import Share


# Letters of a line of a head that is broken, at least; digits of a number from which it is printed as it is.
_HEAD, _DIGITS = 11, 4


@dataclass(frozen=True)
class Table:
    """A titled table; units stand in the column names. Cells are text, numbers, booleans or None.

    Programs read it as it is; people read its angles [rad] in degrees.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def text(self, width: int | None = None, digits: int = _DIGITS) -> str:
        """Aligned columns, numbers to so many digits; where they do not fit in `width`, heads are broken into lines.

        Columns that do not fit even so go below, the first repeated.
        """
        heads, cells, widths = self._layout(width, digits)
        columns = range(len(self.columns))
        right = [not any(isinstance(row[index], str | bool) for row in self.rows) for index in columns]

        def line(values: Sequence[str], chosen: Sequence[int]) -> str:
            padded = [
                values[index].rjust(widths[index]) if right[index] else values[index].ljust(widths[index])
                for index in chosen
            ]
            return "  ".join(padded).rstrip()

        blocks = []
        for chosen in _blocks(widths, width):
            rule = "  ".join("-" * widths[index] for index in chosen)
            high = max(len(heads[index]) for index in chosen)
            lowered = [
                [""] * (high - len(head)) + head if index in chosen else [""] * high for index, head in enumerate(heads)
            ]
            above = [line(values, chosen) for values in zip(*lowered, strict=True)]
            blocks.append("\n".join([*above, rule, *(line(row, chosen) for row in cells)]))
        return "\n".join([printable(self.title), ""] * bool(self.title) + ["\n\n".join(blocks)])

    def within(self, width: int) -> Table:
        """The table without the columns for which a line of `width` columns has no room."""
        shown = _blocks(self._layout(width)[2], width)[0]
        chosen = [[row[index] for index in shown] for row in self.rows]
        return Table(self.title, [self.columns[index] for index in shown], chosen)

    def folded(self, width: int) -> Table:
        """The table no wider than `width`: texts of its last column go on in further rows, without the other cells."""
        room = max(_HEAD, width - sum(each + 2 for each in self._layout(None)[2][:-1]))
        rows = list[Sequence[Any]]()
        for *others, text in self.rows:
            first, *further = in_lines(str(text), room) or [""]
            rows += [(*others, first), *((*[""] * len(others), line) for line in further)]
        return Table(self.title, self.columns, rows)

    def cells(self, digits: int = _DIGITS) -> tuple[list[str], list[list[str]]]:
        """Heads and cells as people read them, numbers to so many digits."""
        plain = [[value.item() if hasattr(value, "item") else value for value in row] for row in self.rows]
        columns, rows = readable(self.columns, plain)
        angles = [column.endswith("[deg]") for column in columns]
        unit_at = columns.index("unit") if "unit" in columns else None
        cells = []
        for row in rows:
            is_angle = unit_at is not None and row[unit_at] == "deg"
            values = zip(row, angles, strict=False)
            cells.append([_cell(value, digits, angle or is_angle) for value, angle in values])
        return [printable(column) for column in columns], cells

    def _layout(self, width: int | None, digits: int = _DIGITS) -> tuple[list[list[str]], list[list[str]], list[int]]:
        """Lines of each head, text of each cell, and the width of each column."""
        columns, cells = self.cells(digits)
        heads = [[column] for column in columns]
        wide = [max(map(len, column), default=0) for column in zip(*cells, strict=True)] or [0] * len(heads)
        widths = [max(cell, len(head)) for cell, (head,) in zip(wide, heads, strict=True)]
        if width is not None and sum(widths) + 2 * (len(widths) - 1) > width:
            heads = [in_lines(head, max(cell, _HEAD)) or [""] for cell, (head,) in zip(wide, heads, strict=True)]
            widths = [max(cell, *map(len, head)) for cell, head in zip(wide, heads, strict=True)]
        return heads, cells, widths


def number(value: float) -> str:
    """Four significant digits; infinities and NaN as a dash, and what rounding has left of nothing as 0."""
    return f"{without_dust(value):.4g}" if math.isfinite(value) else "-"


def _cell(value: Any, digits: int, is_angle: bool) -> str:
    """Text of a cell; of a rounded angle [deg] that nobody could measure that it is less."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str | int):
        return printable(value)
    if digits >= _DIGITS or not math.isfinite(value):
        return number(float(value))
    return degrees(math.radians(value), digits) if is_angle and value > 0.0 else two(value, digits)


def _blocks(widths: Sequence[int], width: int | None) -> list[list[int]]:
    """Indices of the columns in each block: the first everywhere, the others as far as `width` reaches."""
    blocks, used = [[0]], widths[0]
    for index in range(1, len(widths)):
        if width is not None and index > 1 and used + 2 + widths[index] > width:
            blocks.append([0])
            used = widths[0]
        blocks[-1].append(index)
        used += 2 + widths[index]
    return blocks


_ESCAPED = {character: f"\\{character}" for character in "&%$#_{}"} | {
    "<": r"\textless{}", ">": r"\textgreater{}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}",
}  # fmt: skip


def escaped(text: str) -> str:
    """Text with what LaTeX reads as its own written out."""
    return "".join(_ESCAPED.get(character, character) for character in text)


# Columns of a line of an answer, at most.
COLUMNS = 100


def in_lines(text: str, columns: int = COLUMNS) -> list[str]:
    """A text in lines, broken between words."""
    return textwrap.wrap(text, columns, break_long_words=False, break_on_hyphens=False)


def joined(words: Sequence[str], last: str = "and") -> str:
    """Words as a list in a sentence: a, b and c."""
    return f"{', '.join(words[:-1])} {last} {words[-1]}" if len(words) > 1 else "".join(words)


def capital(text: str) -> str:
    """A text that begins a sentence."""
    return text[:1].upper() + text[1:]


def two(value: float, digits: int = 2) -> str:
    """A number to two digits (or so many), as short as it goes: 15000, 0.012, 3.1e-5."""
    shown = f"{without_dust(value):.{digits}g}"
    if "e+" in shown and abs(value) < 1e6:
        return f"{float(shown):.0f}"
    mantissa, _, power = shown.partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def degrees(error: float, digits: int = 2) -> str:
    """An error [rad] in degrees, to so many digits; `<0.001` where nobody could measure it."""
    from wristctl.comparison.bootstrap import MEASURABLE

    if error <= MEASURABLE * (1.0 + 1e-9):
        return f"<{math.degrees(MEASURABLE):g}"
    return two(math.degrees(error), digits)


def percent(share: Share) -> str:
    """A share with its 95 % interval: 0.8 % [0.1, 2.9]."""
    value, low, high = (f"{100.0 * bound:.2g}" for bound in (share.value, share.low, share.high))
    return f"{value} % [{low}, {high}]"
