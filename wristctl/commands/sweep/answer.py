"""The answer of a sweep: where the main metric is least and most, and some of its points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import COLUMNS, Table
from wristctl.commands.quantities import Quantity, of_metric, table_of
from wristctl.study_files.keys import is_command

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
FATE = Quantity("fate", meaning="why a rollout is no good; empty where it is sound")
CONTROLLER = Quantity("controller", meaning="controller with its gains")
_ROLLOUT = (
    Quantity("point", meaning="number of the point"), Quantity("repetition", meaning="number of the repetition"),
    Quantity("failed", meaning="whether the wrist left its range"), Quantity("until", "s", "when it did, or the end"),
    CONTROLLER, FATE,
)  # fmt: skip


def quantities(
    table: pd.DataFrame, settings: Mapping[str, str], about: Mapping[str, Mapping[str, Any]]
) -> dict[str, Quantity]:
    """Quantities of a sweep's columns, by name; of metrics that are not those of a loop by `about`: unit, heading.

    `table` has a row for each point and repetition or controller, `settings` the unit of each that was swept.
    """
    told = {quantity.name: quantity for quantity in (*(_setting(*one) for one in settings.items()), *_ROLLOUT)}

    def quantity(name: str) -> Quantity:
        facts = about.get(name, {})
        metric = of_metric(name, facts.get("unit", ""))
        return told.get(name) or replace(metric, heading=facts.get("heading", metric.heading))

    return {name: quantity(name) for name in map(str, table)}


def _setting(key: str, unit: str) -> Quantity:
    """A setting, called as people type it: without the section of the command."""
    section, _, rest = key.partition(".")
    called = rest if is_command(section) and rest else key
    return Quantity(key, "" if unit == "1" else unit, "as it was set", called, "deg" if unit == "rad" else "")


def metrics_of(columns: Mapping[str, Quantity], keys: Sequence[Quantity]) -> list[Quantity]:
    """Those of the columns that are neither settings nor what became of a rollout."""
    return [quantity for quantity in columns.values() if quantity not in (*keys, *_ROLLOUT)]


def headline(table: pd.DataFrame, metrics: Sequence[Quantity]) -> list[Quantity]:
    """The metrics that are shown: RMSE first, and no other angle that is too small to measure at every point."""

    def tells(metric: Quantity) -> bool:
        return metric.name == "rmse" or not unmeasurable(table[metric.name].dropna(), metric).all()

    known = [metric for metric in metrics if table[metric.name].notna().any()]
    measured = {metric.name: metric for metric in list(filter(tells, known)) or known}
    return list(({name: measured[name] for name in _FIRST if name in measured} | measured).values())[:_METRICS]


def answer(
    command: str, table: pd.DataFrame, keys: Sequence[Quantity], metrics: Sequence[Quantity], run: str = "",
    presets: Sequence[str] = (),
) -> Answer:  # fmt: skip
    """The answer of a sweep for one screen: of its `table` in SI units, what was swept, and the metrics to show.

    The first metric is the main one; `run` is the path, empty for a result in memory. `presets` are the controllers
    with the gains that they have by their loops, where nobody chose any.
    """
    chosen = _some(table, [key.name for key in keys if key.name != CONTROLLER.name])
    where = f"{run}/data/sweep.csv" if run else "`.frame()`"
    more = f"{len(chosen)} of {len(table)} rows; all of them: {where}." if len(chosen) < len(table) else ""
    shown = rows_of(chosen, keys, metrics).within(COLUMNS)
    notes = [f"Gains by loop: {', '.join(presets)}."] if presets else []
    return Answer(sentence(command, table, keys, metrics), shown, notes, more=more)


def rows_of(table: pd.DataFrame, keys: Sequence[Quantity], metrics: Sequence[Quantity]) -> Table:
    """A line for each row: what was set, what became of it where that is no good, and the metrics."""
    fates_of_rows = [FATE] if "fate" in table and table["fate"].any() else []
    return table_of("", [*keys, *fates_of_rows, *metrics], table.to_dict("records"))


def sentence(command: str, table: pd.DataFrame, keys: Sequence[Quantity], metrics: Sequence[Quantity]) -> str:
    """Points where the main metric is least and most, and how often a wrist fails."""
    text = f"{command} at {table['point'].nunique()} points"
    for metric in metrics[:1]:
        text += f": {least(table, keys, metric)}"
        if not unmeasurable(table[metric.name], metric).all():
            text += f"; highest {' at '.join(_extreme(table, keys, metric, 'idxmax'))}"
    for fate, count in fates(table).items():
        text += f"; {count} of {len(table)} {_counted(table)}: {fate}"
    return f"{text}."


def least(table: pd.DataFrame, keys: Sequence[Quantity], metric: Quantity) -> str:
    """Where a metric is least, in words; at how many points nobody could measure it, where these are several."""
    tiny, count = int(unmeasurable(table[metric.name], metric).sum()), len(table)
    if tiny > 1:
        where = f"{tiny} of {count} {_counted(table)}, such as {_extreme(table, keys, metric, 'idxmin')[1]}"
        bound = metric.said(float(measurable(0.0, metric)))
        return f"{metric.words} is below {bound} at {'every point' if tiny == count else where}"
    return f"lowest {metric.words} {' at '.join(_extreme(table, keys, metric, 'idxmin'))}"


def _counted(table: pd.DataFrame) -> str:
    return "rows" if "controller" in table else "rollouts"


def _extreme(table: pd.DataFrame, keys: Sequence[Quantity], metric: Quantity, which: str) -> tuple[str, str]:
    """An extreme value of a metric, and where it is."""
    sound = table[~table["failed"].astype(bool)] if "failed" in table and not table["failed"].all() else table
    row = sound.loc[getattr(sound[metric.name], which)()]
    return metric.said(row[metric.name]), ", ".join(f"{key.words} = {key.said(row[key.name])}" for key in keys)


def measurable(values: ArrayLike, metric: Quantity) -> Array:
    """Values of a metric; angles [rad] that nobody could measure are raised to the least that one can."""
    import numpy as np

    from wristctl.comparison.bootstrap import MEASURABLE

    given = np.array(values, float)
    return np.where(np.abs(given) < MEASURABLE, MEASURABLE, given) if metric.unit == "rad" else given


def unmeasurable(values: ArrayLike, metric: Quantity) -> NDArray[np.bool_]:
    """Mask of the angles that nobody could measure."""
    import numpy as np

    mask: NDArray[np.bool_] = np.asarray(measurable(values, metric) != np.array(values, float)) & np.isfinite(values)
    return mask


def fates(table: pd.DataFrame) -> dict[str, int]:
    """Number of rollouts with each mark. A rollout may have several."""
    if "fate" not in table:
        return {}
    from wristctl.simulation.repetitions import MARKS

    counts = Counter(mark for fate in table["fate"] for mark in fate.split(", ") if mark)
    return {mark: counts[mark] for mark in dict.fromkeys((*MARKS, *counts)) if counts[mark]}


def _some(table: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """At most so many rows as the first screen has; of a swept number in order, from its least to its largest.

    Of a point it has the rows of all controllers, and two points at least.
    """
    import numpy as np

    points = table.drop_duplicates("point") if "controller" in table else table
    most = max(2, round(_ROWS * len(points) / len(table)))
    numbers = [key for key in keys if table[key].dtype.kind in "if"]
    ordered = points.sort_values([*numbers, *(key for key in keys if key not in numbers)], kind="stable")
    if len(ordered) > most:
        points = ordered.iloc[np.unique(np.linspace(0, len(ordered) - 1, most).round().astype(int))]
    elif len(keys) == 1:
        points = ordered
    return points[["point"]].merge(table, on="point") if "controller" in table else points
