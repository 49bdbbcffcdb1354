"""The answer of a sweep: where the main metric is least and most, and some of its points in people's units."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import COLUMNS, Table, number

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import ArrayLike, NDArray

    from wristctl.arrays import Array

# Rows of the table on the first screen, and metrics in it and in the figures.
_ROWS, _METRICS = 12, 4
_FIRST = ("rmse", "steady_state", "oscillation", "chattering")
# Mark of a rollout that left its range.
FAILED = "failed"
# Digits of a swept value, and of a metric.
_DIGITS = 3


def headline(table: pd.DataFrame, metrics: Sequence[str], units: Mapping[str, str]) -> list[str]:
    """The metrics that are shown: RMSE first, and no other angle that is too small to measure at every point."""
    from wristctl.comparison.bootstrap import MEASURABLE

    def tells(name: str) -> bool:
        return name == "rmse" or units.get(name) != "rad" or bool((table[name].abs() > MEASURABLE).any())

    measured = [name for name in metrics if table[name].notna().any() and tells(name)]
    first = [name for name in _FIRST if name in measured]
    return [*first, *(name for name in measured if name not in _FIRST)][:_METRICS]


def for_people(table: pd.DataFrame, units: Mapping[str, str]) -> tuple[pd.DataFrame, dict[str, str]]:
    """The table with its angles in degrees, and the units that it then has."""
    import numpy as np

    angles = [str(name) for name in table if units.get(str(name)) == "rad"]
    return table.assign(**{name: np.rad2deg(table[name]) for name in angles}), dict(units) | dict.fromkeys(
        angles, "deg"
    )


def answer(
    command: str,
    table: pd.DataFrame,
    keys: Sequence[str],
    metrics: Sequence[str],
    units: Mapping[str, str],
    run: str = "",
) -> Answer:
    """The answer of a sweep for one screen.

    Parameters
    ----------
    command
        Name of the command that was swept.
    table
        A row for each point and repetition, angles in degrees.
    keys
        Settings that were swept.
    metrics
        Metrics that are shown, the main one first.
    units
        Unit of each column.
    run
        Path of the run; empty for a result in memory.
    """
    chosen = _some(table, keys)
    where = f"{run}/data/sweep.csv" if run else "`.frame()`"
    more = f"{len(chosen)} of {len(table)} rows; all of them: {where}." if len(chosen) < len(table) else ""
    shown = rows_of(chosen, keys, metrics, units).within(COLUMNS)
    return Answer(sentence(command, table, keys, metrics, units), shown, more=more)


def rows_of(table: pd.DataFrame, keys: Sequence[str], metrics: Sequence[str], units: Mapping[str, str]) -> Table:
    """A line for each row: what was set, what became of it where that is no good, and the metrics."""
    heads = [*keys, *(["fate"] if "fate" in table and table["fate"].any() else []), *metrics]
    lines = [tuple(_cell(value) for value in row) for row in table[heads].itertuples(index=False)]
    units = {name: f" [{units[name]}]" if units.get(name, "1") not in ("", "1") else "" for name in heads}
    return Table("", [f"{name}{units[name]}" for name in heads], lines)


def sentence(
    command: str, table: pd.DataFrame, keys: Sequence[str], metrics: Sequence[str], units: Mapping[str, str]
) -> str:
    """Points where the main metric is least and most, and how often a wrist fails."""
    text = f"{command} at {table['point'].nunique()} points"
    if metrics:
        text += f": {least(table, keys, metrics[0], units)}"
        if not unmeasurable(table[metrics[0]], units[metrics[0]]).all():
            text += f"; highest {' at '.join(_extreme(table, keys, metrics[0], units, 'idxmax'))}"
    for fate, count in fates(table).items():
        text += f"; {count} of {len(table)} rollouts: {fate}"
    return f"{text}."


def least(table: pd.DataFrame, keys: Sequence[str], metric: str, units: Mapping[str, str]) -> str:
    """Where a metric is least, in words; at how many points nobody could measure it, where these are several."""
    tiny, count = int(unmeasurable(table[metric], units[metric]).sum()), len(table)
    if tiny > 1:
        bound = in_unit(metric, float(measurable(0.0, units[metric])), units)
        where = f"{tiny} of {count} rollouts, such as {_extreme(table, keys, metric, units, 'idxmin')[1]}"
        return f"{metric} is below {bound} at {'every point' if tiny == count else where}"
    return f"lowest {metric} {' at '.join(_extreme(table, keys, metric, units, 'idxmin'))}"


def _extreme(
    table: pd.DataFrame, keys: Sequence[str], metric: str, units: Mapping[str, str], which: str
) -> tuple[str, str]:
    """An extreme value of a metric, and where it is."""
    sound = table[~table["failed"].astype(bool)] if "failed" in table and not table["failed"].all() else table
    row = sound.loc[getattr(sound[metric], which)()]
    where = ", ".join(f"{key} = {in_unit(key, row[key], units)}" for key in keys)
    return in_unit(metric, float(row[metric]), units), where


def measurable(values: ArrayLike, unit: str) -> Array:
    """Values of a metric; angles in degrees that nobody could measure are raised to the least that one can."""
    import numpy as np

    from wristctl.comparison.bootstrap import MEASURABLE

    given, floor = np.array(values, float), float(np.rad2deg(MEASURABLE))
    return np.where(np.abs(given) < floor, floor, given) if unit == "deg" else given


def unmeasurable(values: ArrayLike, unit: str) -> NDArray[np.bool_]:
    """Mask of the angles in degrees that nobody could measure."""
    import numpy as np

    mask: NDArray[np.bool_] = np.asarray(measurable(values, unit) != np.array(values, float)) & np.isfinite(values)
    return mask


def fates(table: pd.DataFrame) -> dict[str, int]:
    """Number of rollouts with each mark. A rollout may have several."""
    if "fate" not in table:
        return {}
    from wristctl.simulation.repetitions import MARKS

    counts = Counter(mark for fate in table["fate"] for mark in fate.split(", ") if mark)
    return {mark: counts[mark] for mark in MARKS if counts[mark]}


def _some(table: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """At most so many rows as the first screen has; of a swept number in order, from its least to its largest."""
    import numpy as np

    numbers = [key for key in keys if table[key].dtype.kind in "if"]
    ordered = table.sort_values([*numbers, *(key for key in keys if key not in numbers)], kind="stable")
    if len(ordered) <= _ROWS:
        return ordered if len(keys) == 1 else table
    return ordered.iloc[np.unique(np.linspace(0, len(ordered) - 1, _ROWS).round().astype(int))]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cell(value: Any) -> Any:
    return float(f"{value:.{_DIGITS}g}") if _is_number(value) and math.isfinite(value) else value


def in_unit(name: str, value: Any, units: Mapping[str, str]) -> str:
    """A value of a column with its unit, to three digits."""
    unit = units[name]
    text = number(_cell(float(value))) if _is_number(value) else str(value)
    return text if unit in ("", "1") else f"{text} {unit}"
