"""Quantities of results, described once: for a table's columns, a file's columns and a run's metrics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from wristctl.commands.printed_table import Table, number
from wristctl.commands.results import Findings
from wristctl.reader_units import metric_in_words

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from wristctl.identification.arc_fit import Told

# Share of an interval's wider end below which the value within it is printed as 0.
_NOTHING = 1e-6
# Factors from a unit of files to one that people read; a table turns angles into degrees by itself.
_SCALES = {
    ("1/s", "Hz"): 1.0, ("s", "ms"): 1e3, ("m", "mm"): 1e3, ("m", "um"): 1e6, ("J", "mJ"): 1e3, ("", "%"): 100.0,
    ("rad", "deg"): 180.0 / math.pi,
}  # fmt: skip
# Digits of a number in a sentence.
_DIGITS = 3
# Heads of a table of ranges, and of one of single values.
RANGE, VALUE = ("quantity", "least", "greatest", "unit"), ("what", "value")


@dataclass(frozen=True)
class Quantity:
    """One quantity: its name in files, and how people read it."""

    name: str
    unit: str = ""
    """Of its values in files; SI."""
    meaning: str = ""
    heading: str = ""
    """Over its column, without the unit; empty: its name in words."""
    shown: str = ""
    """Unit in which people read it; empty: that of files."""
    better: Literal["lower", "higher", ""] = ""

    @property
    def words(self) -> str:
        """What people call it."""
        return self.heading or self.name.replace("_", " ")

    @property
    def head(self) -> str:
        """Head of its column, with the unit."""
        unit = self.shown or self.unit
        return f"{self.words} [{unit}]" if unit else self.words

    def cell(self, value: Any) -> Any:
        """A value as a cell of its column; words and None as they are."""
        if not self.shown or value is None or isinstance(value, str | bool):
            return value
        return _SCALES[self.unit, self.shown] * value

    def said(self, value: Any) -> str:
        """A value with its unit in a sentence, to three digits."""
        cell, unit = self.cell(value), self.shown or self.unit
        text = str(cell) if isinstance(cell, str | bool) else f"{cell:.{_DIGITS}g}"
        return f"{text} {unit}" if unit else text


def of_metric(name: str, unit: str = "") -> Quantity:
    """A metric of a closed loop under its heading in tables, or another number in `unit`. Less is better."""
    from wristctl.simulation.metrics import metrics_in

    metric = metrics_in(2).get(name)
    unit, meaning, heading = (metric.unit, metric.formula, metric.heading) if metric else (unit, "", "")
    words = heading.partition(" [")[0] or metric_in_words(name, unit)
    return Quantity(name, unit, meaning, words, "deg" if unit == "rad" else "", "lower")


def table_of(title: str, quantities: Sequence[Quantity], records: Iterable[Mapping[Any, Any]]) -> Table:
    """A table with a column for each quantity and a row for each record, by the quantities' names."""
    rows = [tuple(quantity.cell(record.get(quantity.name)) for quantity in quantities) for record in records]
    return Table(title, tuple(quantity.head for quantity in quantities), rows)


def documented(quantities: Iterable[Quantity]) -> tuple[dict[str, str], dict[str, str]]:
    """Units and meanings of a file's columns by their names."""
    every = list(quantities)
    return {each.name: each.unit for each in every}, {each.name: each.meaning for each in every}


MEANT = "Parameters and their meaning"
"""Title of the table of parameters where a run keeps it with every column."""


def keep_values(
    findings: Findings, values: Iterable[tuple[Quantity, float | None, int]]
) -> list[tuple[str, float | None]]:
    """Values of quantities, each with its sample size, as metrics; a row of VALUE for each."""
    rows = []
    for quantity, value, count in values:
        findings.metric(quantity.name, value, quantity.unit, quantity.better, count, meaning=quantity.meaning)
        rows.append((quantity.head, quantity.cell(value)))
    return rows


def keep_range(
    findings: Findings, quantity: Quantity, values: ArrayLike, unit_in_name: bool = False
) -> tuple[str, float, float, str]:
    """Least and greatest of the values of a quantity, in the unit that people read, as metrics; a row of RANGE.

    The metrics are NAME_min and NAME_max, or NAME_min_UNIT and NAME_max_UNIT.
    """
    import numpy as np

    array, unit = np.asarray(values, float), quantity.shown or quantity.unit
    ends = [quantity.cell(float(end)) for end in (array.min(), array.max())]
    for name, words, end in (("min", "least", ends[0]), ("max", "greatest", ends[1])):
        meaning = f"{words}: {quantity.meaning}"
        findings.metric(f"{quantity.name}_{name}{f'_{unit}' * unit_in_name}", end, unit, n=len(array), meaning=meaning)
    return quantity.words, ends[0], ends[1], unit


def told_table(told: Mapping[str, Told], title: str = "") -> Table:
    """Parameters with their 95 % intervals, or that the data do not tell them."""
    rows = []
    for name, one in told.items():
        nothing = abs(one.value) < _NOTHING * max(abs(one.low), abs(one.high))
        cells = (number(0.0 if nothing else one.value), f"{number(one.low)} to {number(one.high)}")
        rows.append((name, *(cells if one.known else ("not identifiable", "")), one.unit, one.meaning))
    return Table(title, ("parameter", "value", "95 %", "unit", "meaning"), rows)


def told_frame(told: Mapping[str, Told]) -> pd.DataFrame:
    """One row per parameter: value and ends of its interval, nan where the data do not tell it, unit and meaning."""
    import pandas as pd

    rows = [
        (name, *((one.value, one.low, one.high) if one.known else [math.nan] * 3), one.unit, one.meaning)
        for name, one in told.items()
    ]
    return pd.DataFrame(rows, columns=["parameter", "value", "low", "high", "unit", "meaning"])


def keep_told(findings: Findings, told: Mapping[str, Told], of: str = "", n: int = 1) -> None:
    """Parameters as metrics of `n` samples, without a value where the data do not tell it; `of` follows each name."""
    for name, one in told.items():
        ends = (one.low, one.high) if one.known else None
        findings.metric(f"{name}{of}", one.value if one.known else None, one.unit, "", n, ends, one.meaning)
