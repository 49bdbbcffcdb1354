"""Times of logs: dates (ISO 8601), times of the day and Unix times as seconds from the first row."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.recorded_table import line_of

MISSING = ("", "-", "nan", "NaN", "NA", "null")
"""Cells that hold nothing."""

# Seconds from 1970 on that a recording may have: from 2001 to 2103. Of a bare number the size says the unit.
_EARLIEST, _LATEST = 1e9, 4.2e9
_BY_SIZE = ((1e11, "s", 1.0), (1e14, "ms", 1e-3), (1e17, "us", 1e-6), (math.inf, "ns", 1e-9))
_DATE = re.compile(r"\d{4}-?\d{2}-?\d{2}[T ]\d{2}:?\d{2}.*")
_DATE_WITH_POINTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[T ]+(\d{1,2}:\d{2}.*)")
_OF_DAY = re.compile(r"\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?")
_WHOLE = re.compile(r"\s*\d{1,19}\s*")
_DAY = 86400.0


def is_dated(cells: Sequence[str] | np.ndarray[Any, Any]) -> bool:
    """Whether a column begins with a date, a time of the day, or a number as large as a Unix time."""
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "iuf":
        there = cells[np.isfinite(cells)]
        return bool(there.size) and float(there[0]) >= _EARLIEST
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return True
    first = next((cell for cell in map(str.strip, map(str, cells)) if cell not in MISSING), "")
    if any(shape.fullmatch(first) for shape in (_DATE, _DATE_WITH_POINTS, _OF_DAY)):
        return True
    try:
        return math.isfinite(float(first)) and float(first) >= _EARLIEST
    except ValueError:
        return False


def seconds_of(
    cells: Sequence[str] | np.ndarray[Any, Any], scale: float, head: str, file: Path, lines: Sequence[int]
) -> tuple[Array, str]:
    """Seconds (T,) from the first row, nan where a cell is empty, and the sentence that says so.

    Parameters
    ----------
    cells
        A column for which `is_dated` holds: texts, numbers, or numpy's dates.
    scale
        Factor of numbers to seconds; nan where their size is to say it.
    head
        Name of the column, for errors.
    file, lines
        Where the rows stand.

    Raises UserError with the line for a cell that is none, and for a Unix time that its unit puts beyond the year 2103.
    """
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return _from_first(cells.astype("datetime64[ns]"), head, file)
    numbers = cells if isinstance(cells, np.ndarray) and cells.dtype.kind in "iuf" else _numbers(list(cells))
    if numbers is None:
        texts = [str(cell).strip() for cell in cells]
        first = next(text for text in texts if text not in MISSING)
        if _OF_DAY.fullmatch(first):
            return _of_day(texts, head, file, lines)
        return _from_first(_dates(texts, head, file, lines), head, file)
    there = np.isfinite(numbers)
    begin = numbers[there][0]
    unit, factor = next((unit, factor) for size, unit, factor in _BY_SIZE if float(begin) < size)
    told = f", in {unit} by their size" if math.isnan(scale) else ""
    scale = factor if math.isnan(scale) else scale
    if float(begin) * scale > _LATEST:
        problem = f"{head} begins {float(begin) * scale:.3g} s after 1970 by its header"
        raise UserError(problem, line_of(file, lines, 0), f"is it in {unit}?")
    seconds = np.where(there, (numbers - begin).astype(np.float64) * scale, math.nan)
    date = np.datetime64(int(float(begin) * scale * 1e3), "ms")
    return seconds, f"{file.name}: {head} has Unix times{told}; seconds count from the first row, {date}Z."


def is_unix(values: np.ndarray[Any, Any], scale: float) -> bool:
    """Whether numbers, with their factor to seconds, begin after the year 2001."""
    there = values[np.isfinite(values)]
    return bool(there.size) and float(there[0]) * scale >= _EARLIEST


def _numbers(cells: Sequence[Any]) -> np.ndarray[Any, Any] | None:
    """Numbers, whole ones exactly; None where a cell is no number."""
    if all(_WHOLE.fullmatch(str(cell)) for cell in cells):
        return np.array([int(cell) for cell in cells], dtype=np.int64)
    try:
        return np.array([math.nan if str(cell).strip() in MISSING else float(cell) for cell in cells])
    except ValueError:
        return None


def _dates(texts: Sequence[str], head: str, file: Path, lines: Sequence[int]) -> np.ndarray[Any, Any]:
    import pandas as pd

    written = [None if text in MISSING else _with_year_first(text.replace(",", ".")) for text in texts]
    dates = pd.to_datetime(pd.Series(written, dtype=object), format="ISO8601", utc=True, errors="coerce")
    wrong = [place for place, text in enumerate(written) if text is not None and pd.isna(dates.iloc[place])]
    if wrong:
        where = line_of(file, lines, wrong[0])
        raise UserError(f"{head} is {texts[wrong[0]]!r}", where, "a date as 2026-11-27T10:00:00.000")
    return dates.dt.tz_localize(None).to_numpy("datetime64[ns]")


def _with_year_first(text: str) -> str:
    """A date of the day, month and year as ISO 8601 has it."""
    match = _DATE_WITH_POINTS.fullmatch(text)
    return f"{match[3]}-{int(match[2]):02d}-{int(match[1]):02d}T{match[4]}" if match else text


def _from_first(dates: np.ndarray[Any, Any], head: str, file: Path) -> tuple[Array, str]:
    there = ~np.isnat(dates)
    begin = dates[there][0]
    seconds = np.where(there, (dates - begin) / np.timedelta64(1, "s"), math.nan)
    when = np.datetime64(begin, "ms")
    return seconds, f"{file.name}: {head} has dates; seconds count from the first row, {when}."


def _of_day(texts: Sequence[str], head: str, file: Path, lines: Sequence[int]) -> tuple[Array, str]:
    """Seconds of times of the day, on after midnight where they begin again by half a day or more."""
    clock = np.full(len(texts), math.nan)
    for place, text in enumerate(texts):
        if text in MISSING:
            continue
        if not _OF_DAY.fullmatch(text):
            where = line_of(file, lines, place)
            raise UserError(f"{head} is {text!r}", where, "a time of the day as 10:00:00.000")
        hours, minutes, rest = text.replace(",", ".").split(":")
        clock[place] = 3600.0 * int(hours) + 60.0 * int(minutes) + float(rest)
    there = np.flatnonzero(np.isfinite(clock))
    midnights = np.cumsum(np.diff(clock[there], prepend=clock[there[0]]) < -0.5 * _DAY)
    clock[there] += _DAY * midnights
    after = f", {int(midnights[-1])} midnights passed" if midnights[-1] > 1 else ", midnight passed"
    told = (
        f"{file.name}: {head} has times of the day{after if midnights[-1] else ''}; seconds count from the first row."
    )
    return clock - clock[there[0]], told
