"""Tables of text as laboratories have them: separators, decimal commas, encodings, rows of units, text between rows."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path

from wristctl.errors import UserError
from wristctl.records.recorded_table import RecordedTable

_MARKS = (";", "\t", ",")
_COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*")
_POINT = re.compile(r"\s*[-+]?\d*\.\d*(?:[eE][-+]?\d+)?\s*")
_OF_NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
_MOST_TEXT = 20
"""Rows for each line of text that may stand among them."""


def decoded(raw: bytes) -> str:
    """Text of a file in UTF-8, in UTF-16 where its first bytes say so, or in Windows' own encoding of western Europe.

    Raises UnicodeDecodeError for what is none: bytes that no text has.
    """
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        if _OF_NO_TEXT.search(raw):
            raise
        return raw.decode("cp1252")


def cells_of(lines: Sequence[str], mark: str) -> list[list[str]]:
    """Cells of each line; a quote that nothing closes ends with its line."""
    rows = list(csv.reader(lines, delimiter=mark))
    return rows if len(rows) == len(lines) else [next(csv.reader([line], delimiter=mark)) for line in lines]


def table_of(text: str, file: Path, units: Collection[str], header: str, what: str) -> RecordedTable:
    """Part a text into a header and rows.

    Semicolons, tabs or commas part cells; a comma is decimal where one of the first two does. A line of `units` under
    the header gives the columns their units; repeated headers, and up to one line of text for twenty rows, are passed
    over. Raises UserError for an empty text, which is a `what`, and with the line for rows of another length; `header`
    is what a header may look like.
    """
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise UserError(f"the {what} is empty", str(file), f"a header such as {header}, samples below")
    mark = _mark_of([line for _, line in lines])
    parted = list(zip((k for k, _ in lines), cells_of([line for _, line in lines], mark), strict=True))
    width = Counter(len(row) for _, row in parted).most_common(1)[0][0]
    first = next(k for k, (_, row) in enumerate(parted) if len(row) > 1 or width == 1)
    passed = [line for line, _ in parted[:first]]
    header_line, heads = parted[first]
    body = parted[first + 1 :]
    remarks = list[str]()
    if body and _are_units(body[0][1], heads, units):
        heads = [f"{head.strip()} [{unit.strip(' []()')}]" for head, unit in zip(heads, body[0][1], strict=True)]
        heads = [head.removesuffix(" []") for head in heads]
        body = body[1:]
    kept, repeated, torn = list[tuple[int, list[str]]](), 0, 0
    for line, row in body:
        if row == parted[first][1]:
            repeated += 1
        elif len(row) == len(heads):
            kept.append((line, row))
        else:
            if any(_is_number(cell) for cell in row):
                raise _other_length(row, heads, file, line)
            torn = torn or line
            passed.append(line)
    if len(passed) * _MOST_TEXT > len(kept):
        if torn:
            raise _other_length(next(row for line, row in body if line == torn), heads, file, torn)
        raise UserError(f"{len(passed)} lines of text before {len(kept)} rows", str(file), f"a header such as {header}")
    if passed:
        where = ", ".join(map(str, passed[:5])) + (", ..." if len(passed) > 5 else "")
        remarks.append(f"{file.name}: passed over {len(passed)} lines of text (line {where}).")
    if repeated:
        remarks.append(f"{file.name}: passed over the header where it stands again, {repeated} times.")
    rows = [row for _, row in kept]
    commas, points = (any(shape.fullmatch(cell) for row in rows for cell in row) for shape in (_COMMA, _POINT))
    if mark != "," and commas and not points:
        rows = [[cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in row] for row in rows]
        remarks.append(f"{file.name}: commas are read as decimal ones.")
    cells = [[row[place] for row in rows] for place in range(len(heads))]
    return RecordedTable(heads, cells, [line for line, _ in kept], header_line, remarks)


def _mark_of(lines: Sequence[str]) -> str:
    """What parts the cells: the mark that stands equally often, and at all, in most lines; a comma where none does."""
    often = {mark: Counter(line.count(mark) for line in lines).most_common(1)[0] for mark in _MARKS}
    steady = [mark for mark in _MARKS if often[mark][0] > 0 and 2 * often[mark][1] > len(lines)]
    return next(iter(steady), next((mark for mark in (",", ";", "\t") if mark in lines[0]), ","))


def _are_units(row: Sequence[str], heads: Sequence[str], units: Collection[str]) -> bool:
    cells = [cell.strip(" []()") for cell in row]
    bare = not any("[" in head for head in heads)
    return (
        bare
        and len(row) == len(heads)
        and any(cells)
        and all(not cell or {cell, cell.lower()} & set(units) for cell in cells)
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return _COMMA.fullmatch(cell) is not None
    return True


def _other_length(row: Sequence[str], heads: Sequence[str], file: Path, line: int) -> UserError:
    problem = f"{len(row)} cells under {len(heads)} columns"
    return UserError(problem, f"{file}:{line}", "one number for each column")
