"""Open logs: tables of what a wrist did, a line a sample, whose header names each column with its unit.

Columns stand in any order, any of them may be missing, and lines that begin with # say nothing. What others call their
columns is mapped to these names by a text such as `time=t [ms], spool_1=encoder1 [0.175 mm], bend_y=imu [deg]`, or by
the name of a converter that knows a laboratory's files (`wristctl.records.log_converters`). A table of a run, whose
header has names alone, has its units in run.json. The page is docs/open-log.md.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.choices import LOG_FORMATS
from wristctl.errors import OUT, Phrase, UserError
from wristctl.plain_files import LARGEST_DATA, read_plain
from wristctl.records.column_ranges import TENDON_OFFSET
from wristctl.records.files import sha256_of
from wristctl.records.formats import write_table
from wristctl.records.inertial_units import bends_of_unit
from wristctl.records.log_columns import (
    COLUMNS,
    EXAMPLE,
    SYNONYMS,
    TENDON,
    WORDS,
    Names,
    Units,
    chosen_columns,
    entries_of,
    mapped_names,
    name_of,
    proposal,
    units_in_a_line,
    units_of,
)
from wristctl.records.log_times import MISSING, is_dated, is_unix, seconds_of
from wristctl.records.manifest import MANIFEST
from wristctl.records.matlab_vectors import vectors_of
from wristctl.records.parquet_logs import parquet_table
from wristctl.records.recorded_table import Cells, RecordedTable, line_of
from wristctl.records.rigid_bodies import KEYS, BodyNames, bends_of_bodies
from wristctl.records.ros_bags import SUFFIXES, bag_table
from wristctl.records.run import Run
from wristctl.records.table_text import decoded, table_of
from wristctl.records.workbooks import SUFFIXES as WORKBOOKS
from wristctl.records.workbooks import texts_of_sheets

Words = NDArray[np.str_]


@dataclass(frozen=True)
class OpenLog:
    """Columns of a log by their names, T samples each, in SI units; nan where a cell is empty."""

    file: Path
    what: str
    """Description of the log for its author, such as "measured loop"."""
    columns: Mapping[str, Array]
    words: Mapping[str, Words] = field(default_factory=dict)
    heads: Mapping[str, str] = field(default_factory=dict)
    """Names as they stand in the file, by those of an open log."""
    lines: Sequence[int] = ()
    """Line of the file of each sample."""
    header: str = ""
    """File and line of the header."""
    remarks: Sequence[str] = ()
    """What was passed over or read in another way, a sentence each."""
    scales: Mapping[str, float] = field(default_factory=dict)
    """Factors to SI with which columns were read, by their names: what one count of a counter is."""
    mapped: frozenset[str] = frozenset()
    """Names that `--columns` gave to columns."""
    two_clocks: bool = False
    """Whether motors and motion were joined from files on clocks of their own, which tell no delay."""

    def __len__(self) -> int:
        return next((len(column) for column in (*self.columns.values(), *self.words.values())), 0)

    @property
    def time(self) -> Array:
        """Times (T,) [s]; of a log without any the numbers of its samples."""
        return self.columns["time"] if "time" in self.columns else np.arange(len(self), dtype=np.float64)

    def at(self, sample: int) -> str:
        """File and line of a sample, for messages."""
        return line_of(self.file, self.lines, sample)

    def place(self, sample: int | None = None) -> str:
        """File's name and line of a sample, or of the header, for sentences."""
        return Path((self.header or str(self.file)) if sample is None else self.at(sample)).name

    def without_gaps(self, name: str) -> Array:
        """A column that is there, without empty cells. Raises UserError where it has one."""
        empty = np.flatnonzero(np.isnan(self.columns[name]))
        if empty.size:
            raise UserError(f"{self.head(name)} is missing", self.at(int(empty[0])), "a number with a decimal point")
        return self.columns[name]

    def head(self, name: str) -> str:
        """Name of a column as it stands in the file."""
        return self.heads.get(name, name)

    def whole(self, name: str, example: str = EXAMPLE) -> Array:
        """A column without empty cells. Raises UserError where it is missing or has one."""
        if name not in self.columns:
            others = [other for other, standard in SYNONYMS.items() if standard == name]
            shown = f"{name} (or {', '.join(others)})" if others else name
            raise UserError(f"no column {shown}", self.header or str(self.file), f"a header such as {example}")
        return self.without_gaps(name)

    def tendons(self, quantity: str) -> dict[int, Array]:
        """Columns of all tendons' spools [m] or tensions [N] by the tendons' numbers; empty where there are none."""
        return {number: self.whole(f"{quantity}_{number}") for number in self.tendons_of(quantity)}

    def known(self, quantity: str) -> dict[str, Array]:
        """Columns of tendons that hold a number, by their names in the order of the tendons."""
        columns = {name: self.columns[name] for name in (f"{quantity}_{k}" for k in self.tendons_of(quantity))}
        return {name: column for name, column in columns.items() if np.isfinite(column).any()}

    def tendons_of(self, quantity: str) -> list[int]:
        """Numbers of the tendons whose spools, tensions or currents are in the log, sorted."""
        matches = (TENDON.fullmatch(name) for name in self.columns)
        return sorted(int(match[2]) for match in matches if match and match[1] == quantity)

    def bends(self) -> Array | None:
        """Bend in both planes (T, 2) [rad], from bend_y and bend_z or from inclination and orientation; None where
        neither is there. One column alone is a bend in the first plane."""
        if "bend_y" in self.columns or "bend_z" in self.columns:
            one = next(self.columns[name] for name in ("bend_y", "bend_z") if name in self.columns)
            return np.stack([self.columns.get(name, 0.0 * one) for name in ("bend_y", "bend_z")], axis=1)
        if "inclination" not in self.columns:
            return None
        inclination = self.columns["inclination"]
        azimuth = self.columns.get("orientation", 0.0 * inclination)
        bends: Array = inclination[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
        return bends

    def trials(self) -> dict[str, OpenLog]:
        """The log parted by its column `trial`, in the order of their first samples; itself where there is none."""
        if "trial" not in self.words:
            return {"": self}
        return {str(name): self.only(self.words["trial"] == name) for name in dict.fromkeys(self.words["trial"])}

    def only(self, samples: NDArray[np.bool_] | NDArray[np.intp]) -> OpenLog:
        """The log with some of its samples, or with all in another order."""
        columns = {name: column[samples] for name, column in self.columns.items()}
        words = {name: column[samples] for name, column in self.words.items()}
        lines = np.asarray(self.lines)[samples].tolist() if self.lines else ()
        return replace(self, columns=columns, words=words, lines=lines)


def filled(time: Array, column: Array) -> Array:
    """A column (T,) at all times, by lines between the cells that it has; nan before its first and after its last."""
    there = np.isfinite(column)
    if there.all() or not there.any():
        return column
    return np.interp(time, time[there], column[there], np.nan, np.nan)


def read_table(
    file: Path,
    names: str = "",
    what: str = "log",
    others: bool = False,
    more: Mapping[str, Units] | None = None,
    tendon_offset: float = TENDON_OFFSET,
) -> OpenLog:
    """Read an open log from a table. Raises UserError with line and column for what is none, and says what to mend.

    Parameters
    ----------
    file
        CSV, an Excel workbook, parquet, MATLAB's vectors of equal length (before version 7.3), an export of motion
        capture, a bag of ROS.
    names
        Names of another author's columns and rigid bodies, as `--columns` has them.
    what
        Description of the log for its author.
    others
        Whether columns of other names may stand beside them, and are passed over; `names` allows it too.
    more
        Further columns of numbers, with their units.
    tendon_offset
        Distance of the tendons from the axis [m]: units of spools that are not said are proposed by it.
    """
    entries = entries_of(names)
    kinds = [entry for entry in entries if entry in LOG_FORMATS]
    keys = {key: entry for entry in entries if (key := entry.partition("=")[0].strip()) in KEYS and "=" in entry}
    bodies = BodyNames(**{key: entry.partition("=")[2].strip() for key, entry in keys.items()})
    rest = ", ".join(entry for entry in entries if entry not in (*kinds, *keys.values()))
    table = _read(file, what, kinds[0] if kinds else "")
    log = _named(table, file, mapped_names(rest), what, others or bool(entries) or table.others, more, tendon_offset)
    if {"bend_y", "bend_z", "inclination"} & log.columns.keys() and not bodies.said:
        return log
    if table.bodies:
        columns, told = bends_of_bodies(table, bodies, file)
    else:
        columns, told = bends_of_unit(log.columns, bodies, file, log.header, log.at)
    return replace(log, columns={**log.columns, **columns}, remarks=[*log.remarks, *told])


def _read(file: Path, what: str, kind: str) -> RecordedTable:
    """Columns of a file by its ending, or by how its text begins; of a log format that is named, as that."""
    if file.suffix in _READERS:
        return _READERS[file.suffix](file, what)
    text = text_of(file, what)
    first = text[:1000].lstrip().partition("\n")[0]
    known = LOG_FORMATS[kind] if kind else next((one for one in LOG_FORMATS.values() if one.begins(first)), None)
    return known.read(text, file) if known else _text_table(text, file, what)


def _named(
    table: RecordedTable,
    file: Path,
    names: Names,
    what: str,
    others: bool,
    more: Mapping[str, Units] | None,
    tendon_offset: float,
) -> OpenLog:
    where = f"{file}:{table.header_line}" if table.header_line else str(file)
    dated = [place for place, cells in enumerate(table.cells) if is_dated(cells)]
    units = {**COLUMNS, **(more or {})}
    proposed = partial(proposal, table.heads, names, table.cells, tendon_offset)
    chosen = chosen_columns(table.heads, names, units, others, dated, where, proposed)
    lengths = {table.heads[place]: len(table.cells[place]) for place in chosen}
    if len(set(lengths.values())) > 1:
        problem = "vectors of different lengths: " + ", ".join(f"{name} {size}" for name, size in lengths.items())
        raise UserError(problem, str(file), "one number of each for each sample")
    columns, words, remarks = dict[str, Array](), dict[str, Words](), list(table.remarks)
    for place, (name, scale) in chosen.items():
        cells, head = table.cells[place], name_of(table.heads[place])
        if name in WORDS:
            words[name] = np.array([str(cell).strip() for cell in cells], dtype=str)
        elif name == "time" and place in dated and (math.isnan(scale) or _is_date(cells, scale)):
            columns[name], told = seconds_of(cells, scale, head, file, table.lines)
            remarks.append(told)
        else:
            columns[name] = scale * _numbers(cells, head, file, table.lines)
    written = {name: name_of(table.heads[place]) for place, (name, _) in chosen.items()}
    scales = {name: scale for name, scale in chosen.values() if name not in WORDS and not math.isnan(scale)}
    mapped = frozenset(name for name, _ in names.values())
    return OpenLog(file, what, columns, words, written, table.lines, where, remarks, scales, mapped)


def _is_date(cells: Cells, scale: float) -> bool:
    """Whether a column with a unit holds dates, or numbers that are Unix times in it."""
    try:
        return is_unix(np.asarray(cells, dtype=np.float64), scale)
    except ValueError:
        return True


def _text_table(text: str, file: Path, what: str) -> RecordedTable:
    return table_of(text, file, units_in_a_line(), EXAMPLE, what)


def _matlab_table(file: Path, what: str) -> RecordedTable:
    vectors = vectors_of(file, what)
    return RecordedTable(list(vectors), list(vectors.values()))


def _workbook_table(file: Path, what: str) -> RecordedTable:
    """A sheet, or several under the same header as trials, which a column `trial` names where they have none."""
    sheets = {name: _text_table(text, file, what) for name, text in texts_of_sheets(file).items()}
    first, *_ = tables = list(sheets.values())
    if not all(table.heads == first.heads for table in tables):  # units stand in a line of their own
        raise UserError("sheets under one header with other units", str(file), "the units of the first in all")
    heads, columns = list(first.heads), zip(*(table.cells for table in tables), strict=True)
    cells: list[Cells] = [[*chain(*of_sheets)] for of_sheets in columns]
    if len(sheets) > 1 and "trial" not in heads:
        heads.append("trial")
        cells.append([name for name, table in sheets.items() for _ in table.lines])
    remarks = dict.fromkeys(chain(*(table.remarks for table in tables)))
    return RecordedTable(heads, cells, [*chain(*(table.lines for table in tables))], first.header_line, list(remarks))


_READERS: Mapping[str, Callable[[Path, str], RecordedTable]] = {
    ".parquet": parquet_table,
    ".mat": _matlab_table,
    **dict.fromkeys(WORKBOOKS, _workbook_table),
    **dict.fromkeys(SUFFIXES, bag_table),
}


def _numbers(cells: Cells, head: str, file: Path, lines: Sequence[int]) -> Array:
    """Numbers of a column, nan where a cell is empty."""
    try:
        values: Array = np.array(cells, dtype=np.float64) if len(cells) else np.empty(0)
    except ValueError:
        values = np.array([_number(str(cell), head, line_of(file, lines, row)) for row, cell in enumerate(cells)])
    if (endless := np.flatnonzero(np.isinf(values))).size:
        _number(str(cells[endless[0]]), head, line_of(file, lines, int(endless[0])))
    return values


def _number(cell: str, head: str, where: str) -> float:
    if cell.strip() in MISSING:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{head} is {cell.strip()!r}", where, "a number with a decimal point")
    return value


def text_of(file: Path, what: str = "log") -> str:
    """Text of a file, with units in its header where it is a table of a run."""
    try:
        text = decoded(read_plain(file, LARGEST_DATA)).replace("\r\n", "\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8, UTF-16 or Windows-1252"
        problem = f"cannot read the {what}: {reason}"
        raise UserError(problem, str(file), f"a CSV file with a header such as {EXAMPLE}") from error
    return with_units(text, file)


def with_units(text: str, file: Path) -> str:
    """The text of a table; of one that a run wrote, and that is as sealed, with units in its header."""
    head, end, body = text.partition("\n")
    if "[" in head or (units := _units_in_run(file)) is None:
        return text
    names = next(csv.reader([head]), [])
    return ",".join(f"{name} [{units[name]}]" if units.get(name) else name for name in names) + end + body


def _units_in_run(file: Path) -> dict[str, str] | None:
    """The units of a run's table by column, None where the file is none of a run, or no longer what it wrote."""
    full_path = file.absolute()
    folder = next((parent for parent in full_path.parents[:3] if (parent / MANIFEST).is_file()), None)
    if folder is None:
        return None
    name = full_path.relative_to(folder).as_posix()
    outputs = [output for output in Run(folder).manifest.outputs if output.path == name and output.columns]
    if not outputs or outputs[0].sha256 != sha256_of(full_path):
        return None
    return {column.name: column.unit for column in outputs[0].columns}


def write_log(log: OpenLog, file: Path, by: Phrase = OUT) -> None:
    """Write an open log as CSV, in SI units; numbers read back exactly, nan is an empty cell.

    `by` is the argument that names another place, where this one cannot be written.
    """
    units = {name: next(unit for unit, scale in (units_of(name) or {}).items() if scale == 1.0) for name in log.columns}
    write_table(file, {f"{name} [{units[name]}]": column for name, column in log.columns.items()} | {**log.words}, by)
