"""What a comparison on loops leaves: figures, and tables of each loop beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from wristctl.config.control import CompareSettings
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Findings

if TYPE_CHECKING:
    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.step_cost import StepTime

_DETAILED = 3
"""Comparisons of more loops than this draw the details of the first only."""

_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")
"""Metrics in the order of the printed table's columns; others that have a heading follow."""


def draw(findings: Findings, settings: CompareSettings, results: list[ComparedRow]) -> None:
    """Over the loops RMSE for each reference, and angles; for each loop (of many only the first) the same over the
    references, chattering, and the errors over time of each of the paper's controllers."""
    from wristctl.comparison.paper import T2
    from wristctl.report.compare_figures import angle_grid, chattering_bars, rmse_map
    from wristctl.report.loop_figures import errors
    from wristctl.report.repetition_figures import error_sizes

    loops = list(settings.loops)
    if len(loops) > 1:
        for number, reference in enumerate(dict.fromkeys(r.reference for r in results), start=1):
            own = [r for r in results if r.reference == reference]
            findings.figure(f"robustness-{number}", rmse_map, own, reference, "loop")
        move = next((r.reference for r in results if not r.reference.startswith("step")), results[0].reference)
        own = [r for r in results if r.reference == move and r.inverse == settings.inverses[0]]
        findings.figure("angles", angle_grid, own, move, "loop")
    for loop in loops if len(loops) <= _DETAILED else loops[:1]:
        here = [r for r in results if r.loop == loop]
        first = [r for r in here if r.inverse == settings.inverses[0]]
        findings.figure(f"angles-{loop}", angle_grid, first, f"loop {loop}")
        findings.figure(f"rmse-{loop}", rmse_map, here, f"loop {loop}")
        findings.figure(f"chattering-{loop}", chattering_bars, here, f"loop {loop}")
        moves = [r for r in first if not r.reference.startswith("step")] or first
        shown = [r for r in moves if r.reference == moves[0].reference]
        for name in T2:
            courses = [r.simulation.trajectory for r in shown if r.controller == name]
            if courses:
                heading = f"{name}, loop {loop}, {shown[0].reference}"
                findings.figure(f"error-{name}-{loop}", errors, courses, heading)
                findings.figure(f"error-log-{name}-{loop}", errors, courses, heading, log=True)
        repeated = [r.repeated for r in shown if len(r.repeated.failed) > 1]
        if repeated:
            findings.figure(f"error-repetitions-{loop}", error_sizes, repeated, f"loop {loop}, {shown[0].reference}")


def units() -> dict[str, str]:
    """Of the columns of its table."""
    from wristctl.simulation.metrics import METRICS

    own = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in own.items() for end in ("low", "high")}
    return own | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


def loop_tables(loop: str, results: list[ComparedRow]) -> list[Table]:
    """A table for each reference on one loop; of repetitions medians, with the interval of the RMSE's."""
    from wristctl.simulation.metrics import METRICS

    shown = {name: METRICS[name].heading for name in dict.fromkeys((*_FIRST, *METRICS)) if METRICS[name].heading}
    times = max(len(result.repeated.failed) for result in results)
    ends = ("RMSE's 95 % low", "high") if times > 1 else ()
    tables = []
    for reference in dict.fromkeys(result.reference for result in results):
        rows = [_row(result, shown, bool(ends)) for result in results if result.reference == reference]
        heads = ("controller", "inverse", *shown.values(), *ends, "paper's", "verdict", "fate")
        medians = f", medians of {times} repetitions" if ends else ""
        tables.append(Table(f"Loop {loop}, {reference}{medians}", heads, rows))
    return tables


def _row(result: ComparedRow, shown: Iterable[str], repeated: bool) -> tuple[str | float, ...]:
    from wristctl.comparison.comparison_data import metrics_of
    from wristctl.comparison.statistics import spread

    metrics = metrics_of(result)
    never = "failed" if result.repeated.failed.any() else "never"
    settling = metrics["settling"] if metrics["settling"] == metrics["settling"] else never
    values = [settling if name == "settling" else metrics[name] for name in shown]
    ends = spread(result.repeated.metrics["rmse"])[1:3] if repeated else ()
    return (result.label, result.inverse, *values, *ends, *_paper(result), result.repeated.fate)


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
