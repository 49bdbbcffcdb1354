"""Tables of a comparison on loops, each loop's beside the paper's numbers where those can be meant."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import TYPE_CHECKING

from wristctl.report.printed_table import Table

if TYPE_CHECKING:
    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.step_cost import StepTime

_OF_REST = ("settling", "overshoot")
"""Metrics that a motion which never rests does not have."""
_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")
"""Metrics in the order of the printed table's columns; others that have a heading follow."""

STANDING_UNITS = dict.fromkeys(("rmse", "rmse_low", "rmse_high", "swing"), "rad") | {"peak": "N"}
"""Of the columns of the table of standings."""


def units() -> dict[str, str]:
    """Of the columns of its table."""
    from wristctl.simulation.metrics import METRICS

    own = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in own.items() for end in ("low", "high")}
    return own | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


def loop_tables(loop: str, results: list[ComparedRow], cells: Container[tuple[str, str]]) -> list[Table]:
    """A table for each reference on one loop; of repetitions medians, with the interval of the RMSE's.

    The paper's numbers stand in those of the `cells` (loop, reference) alone; a motion that never rests has neither
    settling time nor overshoot.
    """
    from wristctl.simulation.metrics import METRICS
    from wristctl.simulation.trajectory import rests

    shown = {name: METRICS[name].heading for name in dict.fromkeys((*_FIRST, *METRICS)) if METRICS[name].heading}
    times = max(len(result.repeated.failed) for result in results)
    ends = ("RMSE's 95 % low", "high") if times > 1 else ()
    tables = []
    for reference in dict.fromkeys(result.reference for result in results):
        own, theirs = [each for each in results if each.reference == reference], (loop, reference) in cells
        columns = [name for name in shown if rests(own[0].simulation.trajectory) or name not in _OF_REST]
        rows = [_row(result, columns, bool(ends), theirs) for result in own]
        papers = ("paper's", "verdict") if theirs else ()
        heads = ("controller", "inverse", *(shown[name] for name in columns), *ends, *papers, "fate")
        medians = f", medians of {times} repetitions" if ends else ""
        tables.append(Table(f"Loop {loop}, {reference}{medians}", heads, rows))
    return tables


def _row(result: ComparedRow, shown: Iterable[str], repeated: bool, theirs: bool) -> tuple[str | float, ...]:
    from wristctl.comparison.comparison_data import metrics_of
    from wristctl.comparison.statistics import spread

    metrics = metrics_of(result)
    never = "failed" if result.repeated.failed.any() else "never"
    settling = metrics["settling"] if metrics["settling"] == metrics["settling"] else never
    values = [settling if name == "settling" else metrics[name] for name in shown]
    ends = spread(result.repeated.metrics["rmse"])[1:3] if repeated else ()
    papers = _paper(result) if theirs else ()
    return (result.label, result.inverse, *values, *ends, *papers, result.repeated.fate)


def step_table(times: dict[str, StepTime]) -> Table:
    """What a control step costs here."""
    rows = [(label, time.median, time.p99) for label, time in times.items()]
    return Table("Control step of one wrist on this machine", ("controller", "median [us]", "p99 [us]"), rows)


def _paper(result: ComparedRow) -> tuple[str, str]:
    from wristctl.comparison.comparison_data import metrics_of
    from wristctl.comparison.paper import T2, verdict

    if result.controller not in T2:
        return "", ""
    metrics = metrics_of(result)
    printed = " / ".join(f"{value:g}" for value in T2[result.controller])
    return printed, verdict(result.controller, metrics["rmse"], metrics["settling"], metrics["steady_state"])
