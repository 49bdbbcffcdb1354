"""Tables that somebody measured: CSV files whose header names each column with its unit, as `time [s],angle [deg]`.

Columns stand in any order; lines that begin with # say nothing. A table of a run, whose header has names alone, has its
units in run.json.
"""

import csv
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError, meant
from wristctl.records.files import sha256_of
from wristctl.records.manifest import MANIFEST
from wristctl.records.run import Run

_HEAD = re.compile(r"\s*(\w+)\s*(?:\[\s*([^]]*?)\s*\])?\s*")

# Columns that there may be, and of each the units that it may have, with their factor to SI.
Units = Mapping[str, Mapping[str, float]]

TIME: Mapping[str, float] = {"s": 1.0, "ms": 1e-3}
ANGLE: Mapping[str, float] = {"deg": math.pi / 180.0, "rad": 1.0}
LENGTH: Mapping[str, float] = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
NUMBER: Mapping[str, float] = {"": 1.0}


@dataclass(frozen=True)
class MeasuredTable:
    """Columns by name in SI units, (T,) each, and the line of the file in which each sample stands."""

    file: Path
    columns: Mapping[str, Array]
    lines: Sequence[int]

    def at(self, sample: int) -> str:
        """File and line of a sample, for messages."""
        return f"{self.file}:{self.lines[sample]}"


@dataclass(frozen=True)
class Expected:
    """Description of a table for its author: name, columns, required columns, and a header as an example."""

    what: str
    units: Units
    needed: Sequence[str]
    example: str
    others: bool = False
    """Whether columns of other names may stand beside them, and are passed over."""

    def read(self, file: Path) -> MeasuredTable:
        """The table of a file. Raises UserError for what is none, with line and column, and what would mend it."""
        lines = [(k, line) for k, line in enumerate(self.text(file).splitlines(), 1) if line.strip() and line[0] != "#"]
        if not lines:
            raise UserError(f"the {self.what} is empty", str(file), f"a header such as {self.example}, samples below")
        heads, where = next(csv.reader([lines[0][1]])), f"{file}:{lines[0][0]}"
        scales = self._scales(heads, where)
        rows = [(_cells(line, len(heads), f"{file}:{number}"), f"{file}:{number}") for number, line in lines[1:]]
        columns = {
            name: scale * np.array([_value(row[column], name, where) for row, where in rows])
            for column, (name, scale) in scales.items()
        }
        return MeasuredTable(file, columns, [number for number, _ in lines[1:]])

    def text(self, file: Path) -> str:
        """Text of the file, with units in the header where it is a table of a run."""
        try:
            text = file.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8"
            problem = f"cannot read the {self.what}: {reason}"
            raise UserError(problem, str(file), f"a CSV file with a header such as {self.example}") from error
        return with_units(text, file)

    def _scales(self, heads: Iterable[str], where: str) -> dict[int, tuple[str, float]]:
        """Name and factor of the columns that are read, by their place in a line."""
        scales: dict[int, tuple[str, float]] = {}
        for column, cell in enumerate(heads):
            match = _HEAD.fullmatch(cell)
            name, unit = (match[1], match[2] or "") if match else (cell.strip(), "")
            if name not in self.units:
                if self.others:
                    continue
                if match is None or match[2] is None:
                    problem = f"column {name!r} is no name with a unit"
                    raise UserError(problem, where, f"name [unit], as in {self.example}")
                raise UserError(f"unknown column {name!r}", where, f"{meant(name, self.units)} Else leave it out")
            units = self.units[name]
            if not unit and "" not in units:
                problem = f"column {name!r} is no name with a unit"
                raise UserError(problem, where, f"{name} [{'] or ['.join(units)}], as in {self.example}")
            if unit not in units:
                raise UserError(f"{name} is in {unit!r}", where, f"{name} [{'] or ['.join(units)}]")
            if name in (listed for listed, _ in scales.values()):
                raise UserError(f"column {name} stands there twice", where, "leave one out")
            scales[column] = name, units[unit]
        for name in self.needed:
            if name not in (listed for listed, _ in scales.values()):
                raise UserError(f"no column {name}", where, f"a header such as {self.example}")
        return scales


def _cells(line: str, count: int, where: str) -> list[str]:
    cells = next(csv.reader([line]))
    if len(cells) != count:
        raise UserError(f"{len(cells)} cells under {count} columns", where, "one number for each column")
    return cells


def _value(cell: str, name: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{name} is {cell.strip()!r}", where, "a number with a decimal point")
    return value


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
