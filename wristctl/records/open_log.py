"""Open logs: tables of what a wrist did, a line a sample, whose header names each column with its unit.

Columns stand in any order, any of them may be missing, and lines that begin with # say nothing. What others call their
columns is mapped to these names by a text such as `time=t [ms], spool_1=encoder1 [0.175 mm], bend_y=imu [deg]`, or by
the name of a converter that knows a laboratory's files (`wristctl.records.log_converters`). A table of a run, whose
header has names alone, has its units in run.json. The page is docs/open-log.md.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.errors import OUT, Argument, Phrase, UserError, meant
from wristctl.plain_files import LARGEST_DATA, open_plain, read_plain
from wristctl.records.files import replacing, sha256_of
from wristctl.records.manifest import MANIFEST
from wristctl.records.matlab_vectors import vectors_of
from wristctl.records.run import Run
from wristctl.records.table_text import decoded, table_of

Units = Mapping[str, float]
"""Units that a column may have, with their factors to SI."""
Words = NDArray[np.str_]

TIME: Units = {"s": 1.0, "ms": 1e-3}
ANGLE: Units = {"deg": math.pi / 180.0, "rad": 1.0}
LENGTH: Units = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
FORCE: Units = {"N": 1.0}
MASS: Units = {"kg": 1.0, "g": 1e-3}

COLUMNS: Mapping[str, Units] = {
    "time": TIME,
    "bend_y": ANGLE,
    "bend_z": ANGLE,
    "inclination": ANGLE,
    "orientation": ANGLE,
    "tip_x": LENGTH,
    "tip_y": LENGTH,
    "tip_z": LENGTH,
    "mass": MASS,
    "pose": ANGLE,
}
"""Columns of numbers, beside those of tendons."""
OF_TENDONS: Mapping[str, Units] = {"spool": LENGTH, "tension": FORCE}
WORDS = ("trial", "marker")
"""Columns of words."""

SYNONYMS: Mapping[str, str] = {
    "angle": "bend_y",
    "bend": "bend_y",
    "theta": "bend_y",
    "x": "tip_x",
    "y": "tip_y",
    "z": "tip_z",
    "hand_mass": "mass",
    "spool_plus": "spool_1",
    "spool_minus": "spool_2",
    "tension_plus": "tension_1",
    "tension_minus": "tension_2",
}
"""Other names of columns. In a plane the + side's tendon is the first, that of the - side the second."""

EXAMPLE = "time [s],angle [deg],spool_1 [mm],spool_2 [mm]"

# Most letters of a column's name.
_LONGEST = 1000
_HEAD = re.compile(r"\s*(.*?)\s*(?:\[\s*([^]]*?)\s*\])?\s*")
_TENDON = re.compile(rf"({'|'.join(OF_TENDONS)})_([1-9]\d*)")
_SCALED = re.compile(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?:x\s*)?(\S*)")
_MISSING = ("", "-", "nan", "NaN", "NA", "null")


def units_of(name: str) -> Units | None:
    """Units of a column of numbers by its name in an open log, None of no such column."""
    tendon = _TENDON.fullmatch(name)
    return OF_TENDONS[tendon[1]] if tendon else COLUMNS.get(name)


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

    def __len__(self) -> int:
        return next((len(column) for column in (*self.columns.values(), *self.words.values())), 0)

    def at(self, sample: int) -> str:
        """File and line of a sample, for messages."""
        return f"{self.file}:{self.lines[sample]}" if self.lines else str(self.file)

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
        numbers = sorted(int(match[2]) for name in self.columns if (match := _TENDON.fullmatch(name)))
        names = {number: f"{quantity}_{number}" for number in numbers}
        return {number: self.whole(name) for number, name in names.items() if name in self.columns}

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

    def only(self, samples: NDArray[np.bool_]) -> OpenLog:
        """The log with some of its samples."""
        columns = {name: column[samples] for name, column in self.columns.items()}
        words = {name: column[samples] for name, column in self.words.items()}
        lines = np.asarray(self.lines)[samples].tolist() if self.lines else ()
        return replace(self, columns=columns, words=words, lines=lines)


def read_table(
    file: Path, names: str = "", what: str = "log", others: bool = False, more: Mapping[str, Units] | None = None
) -> OpenLog:
    """Read an open log from a table. Raises UserError with line and column for what is none, and says what to mend.

    Parameters
    ----------
    file
        CSV, parquet where pandas can read it, or MATLAB's vectors of equal length (before version 7.3).
    names
        Names of another author's columns, as `--columns` has them.
    what
        Description of the log for its author.
    others
        Whether columns of other names may stand beside them, and are passed over; `names` allows it too.
    more
        Further columns of numbers, with their units.
    """
    table = _Table(file, what, {**COLUMNS, **(more or {})}, others or bool(names.strip()), mapped_names(names))
    return {".parquet": table.read_parquet, ".mat": table.read_matlab}.get(file.suffix, table.read_csv)()


def mapped_names(text: str) -> dict[str, tuple[str, str]]:
    """Name in an open log and unit, by another author's name: `bend_y=imu [deg]` gives {"imu": ("bend_y", "deg")}."""
    mapped: dict[str, tuple[str, str]] = {}
    for entry in filter(str.strip, re.split(r",(?![^[]*\])", text)):
        standard, equals, theirs = entry.partition("=")
        head = _HEAD.fullmatch(theirs)
        name = SYNONYMS.get(standard.strip(), standard.strip())
        if not equals or head is None or not head[1]:
            raise UserError(f"{entry.strip()!r} maps no column", "columns", "time=t [ms], bend_y=imu [deg]")
        if units_of(name) is None and name not in WORDS:
            fix = meant(name, [*COLUMNS, *WORDS, "spool_1", "tension_1"])
            raise UserError(f"{name} is no column of an open log", "columns", fix)
        mapped[head[1]] = name, head[2] or ""
    return mapped


@dataclass(frozen=True)
class _Table:
    file: Path
    what: str
    units: Mapping[str, Units]
    others: bool
    names: Mapping[str, tuple[str, str]]

    def read_csv(self) -> OpenLog:
        known = {unit for units in (*self.units.values(), *OF_TENDONS.values()) for unit in units}
        table = table_of(text_of(self.file, self.what), self.file, known, EXAMPLE)
        if table is None:
            problem = f"the {self.what} is empty"
            raise UserError(problem, str(self.file), f"a header such as {EXAMPLE}, samples below")
        heads, where = table.heads, f"{self.file}:{table.header_line}"
        body, lines_of = table.rows, table.lines
        chosen = self._chosen(heads, where)
        columns, words = dict[str, Array](), dict[str, Words]()
        for place, (name, scale) in chosen.items():
            column = [row[place] for row in body]
            if name in WORDS:
                words[name] = np.array([cell.strip() for cell in column])
            else:
                columns[name] = scale * _numbers(column, heads[place], self.file, lines_of)
        written = {name: _name_of(heads[place]) for place, (name, _) in chosen.items()}
        return OpenLog(self.file, self.what, columns, words, written, lines_of, where, table.remarks)

    def read_parquet(self) -> OpenLog:
        import pandas as pd

        try:
            with open_plain(self.file, LARGEST_DATA) as stream:
                frame = pd.read_parquet(stream)
        except ImportError:
            raise UserError("pandas cannot read parquet files here", str(self.file), "pip install pyarrow") from None
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UserError(f"cannot read the {self.what}: {reason}", str(self.file), "check the path") from error
        heads = [str(name) for name in frame.columns]
        columns, words = dict[str, Array](), dict[str, Words]()
        chosen = self._chosen(heads, str(self.file))
        for place, (name, scale) in chosen.items():
            values = frame.iloc[:, place]
            if name in WORDS:
                words[name] = values.astype(str).to_numpy(str)
            else:
                columns[name] = scale * values.to_numpy(float)
        written = {name: _name_of(heads[place]) for place, (name, _) in chosen.items()}
        return OpenLog(self.file, self.what, columns, words, written)

    def read_matlab(self) -> OpenLog:
        vectors = vectors_of(self.file, self.what)
        heads = list(vectors)
        chosen = self._chosen(heads, str(self.file))
        lengths = {heads[place]: len(vectors[heads[place]]) for place in chosen}
        if len(set(lengths.values())) > 1:
            problem = "vectors of different lengths: " + ", ".join(f"{name} {size}" for name, size in lengths.items())
            raise UserError(problem, str(self.file), "one number of each for each sample")
        columns = {name: scale * vectors[heads[place]] for place, (name, scale) in chosen.items()}
        written = {name: heads[place] for place, (name, _) in chosen.items()}
        return OpenLog(self.file, self.what, columns, {}, written)

    def _chosen(self, heads: Iterable[str], where: str) -> dict[int, tuple[str, float]]:
        """Name and factor to SI of the columns that are read, by their places in a line."""
        chosen, missing = dict[int, tuple[str, float]](), dict(self.names)
        for place, cell in enumerate(heads):
            if len(cell) > _LONGEST:
                raise UserError(f"a column's name has {len(cell)} letters", where, f"a header such as {EXAMPLE}")
            match = _HEAD.fullmatch(cell)
            written, unit = (match[1], match[2] or "") if match else (cell.strip(), "")
            name = SYNONYMS.get(written, written)
            if written in self.names:
                name, mapped_unit = missing.pop(written, self.names[written])
                unit = mapped_unit or unit
            elif cell.strip() in self.names:
                name, unit = missing.pop(cell.strip(), self.names[cell.strip()])
            units = self.units.get(written) or units_of(name) or ({"": 1.0} if name in WORDS else None)
            if units is None:
                if self.others:
                    continue
                self._refuse_unknown(written, match is None or match[2] is None, where)
            if name in (other for other, _ in chosen.values()):
                raise UserError(f"column {written} stands there twice", where, f"leave one out that is {name}")
            chosen[place] = name, _factor(written, name, unit, units, where)
        for theirs, (name, _) in missing.items():
            fix = meant(theirs, [_name_of(head) for head in heads])
            raise UserError(f"no column {theirs!r}, which is to be {name}", where, fix)
        return chosen

    def _refuse_unknown(self, written: str, bare: bool, where: str) -> NoReturn:
        choices = [*self.units, *WORDS, *SYNONYMS, "spool_3", "tension_3"]
        if bare:
            raise _without_unit(written, f"a header as {EXAMPLE}", f"NAME={written} [UNIT]", where)
        fix = (f"{meant(written, choices)} Else leave it out, or ", Argument("columns", f"NAME={written}", quoted=True))
        raise UserError(f"unknown column {written!r}", where, fix)


def _without_unit(written: str, head: str, mapped: str, where: str) -> UserError:
    fix = (f"{head}; or leave the file as it is: ", Argument("columns", mapped, quoted=True))
    return UserError(f"column {written!r} has no unit", where, fix)


def _name_of(head: str) -> str:
    match = _HEAD.fullmatch(head)
    return match[1] if match else head.strip()


def _factor(written: str, name: str, unit: str, units: Units, where: str) -> float:
    """Factor to SI of a unit, which may be a multiple of one: 0.175 mm; `name` is what the column is here."""
    if unit in units:
        return units[unit]
    choices = f"{written} [{'] or ['.join(units)}]"
    if not unit:
        raise _without_unit(written, choices, f"{name}={written} [{next(iter(units))}]", where)
    scaled = _SCALED.fullmatch(unit)
    if scaled is None or scaled[2] not in units:
        raise UserError(
            f"{written} is in {unit!r}", where, f"{choices}, or a multiple such as [0.5 {next(iter(units))}]"
        )
    return float(scaled[1]) * units[scaled[2]]


def _numbers(cells: Sequence[str], head: str, file: Path, lines: Sequence[int]) -> Array:
    """Numbers of a column, nan where a cell is empty."""
    try:
        values: Array = np.array(cells, dtype=str).astype(np.float64) if cells else np.empty(0)
    except ValueError:
        values = np.array([_number(cell, head, f"{file}:{line}") for cell, line in zip(cells, lines, strict=True)])
    if (endless := np.flatnonzero(np.isinf(values))).size:
        _number(cells[endless[0]], head, f"{file}:{lines[endless[0]]}")
    return values


def _number(cell: str, head: str, where: str) -> float:
    if cell.strip() in _MISSING:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{_name_of(head)} is {cell.strip()!r}", where, "a number with a decimal point")
    return value


def text_of(file: Path, what: str = "log") -> str:
    """Text of a file, with units in its header where it is a table of a run."""
    try:
        text = decoded(read_plain(file, LARGEST_DATA)).replace("\r\n", "\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8 or UTF-16"
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
    heads = [*(f"{name} [{units[name]}]" for name in log.columns), *log.words]
    columns = [*(column.tolist() for column in log.columns.values()), *(words.tolist() for words in log.words.values())]
    with replacing(file, by) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows([None if cell != cell else cell for cell in row] for row in zip(*columns, strict=True))
