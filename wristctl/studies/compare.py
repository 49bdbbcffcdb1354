"""Controllers under the same conditions, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

from wristctl.config.control import CompareSettings
from wristctl.config.errors import under
from wristctl.config.study import Study
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Findings
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.loop_inputs import check_inverses, check_row, network_for, tuned_gains, tuned_on
from wristctl.studies.loop_warnings import warn_if_coarse, warn_if_it_buckles, warn_outside_conditions
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult
from wristctl.studies.tune import planned_search, search_all

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.step_cost import StepTime
    from wristctl.tuning.gains_file import Gains
    from wristctl.tuning.search import Search

_DETAILED = 3
"""Comparisons of more loops than this draw the details of the first only."""

_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")
"""Metrics in the order of the printed table's columns; others that have a heading follow."""


@dataclass(frozen=True, repr=False, eq=False)
class Compared(StudyResult):
    """Every combination of controller, loop, reference, direction and inverse."""

    kind = "compare"

    rows: list[ComparedRow]
    """each with the simulation of its loop"""
    searches: dict[str, Search]
    """of the controllers that were tuned here, by name"""
    step_times: dict[str, StepTime]
    """median and 99th percentile of a control step on this machine [us], by controller/gains"""

    def frame(self) -> pd.DataFrame:
        """One row per combination: every metric beside the paper's."""
        from wristctl.comparison.comparison_data import frame

        return frame(self.rows)

    def series(self) -> dict[str, np.ndarray]:
        """Courses over time, one row per combination, every fifth sample; SI units."""
        from wristctl.comparison.comparison_data import series

        return dict(series(self.rows))


def plan(study: Study, inputs: Inputs) -> str:
    """Check names and say how many rollouts there will be."""
    from wristctl.comparison.combinations import count_rollouts, refuse_tuned_scenarios
    from wristctl.report.truth_table import truth_told
    from wristctl.simulation.size import check_size

    settings, earlier, searched = study.compare, tuned_on(inputs), ""
    found_here = settings.tuning.controllers if settings.tuning is not None else ()
    for number, row in enumerate(settings.rows):
        if row.gains != "tuned" or row.controller not in found_here:
            with under(f"compare.rows.{number}"):
                check_row(row, tuned_gains(inputs))
    if settings.tuning is not None:
        with under("compare.tuning"):
            searched = f"a search first: {planned_search(settings.tuning)}\n"
        refuse_tuned_scenarios(settings, settings.tuning)
    if earlier is not None:
        refuse_tuned_scenarios(settings, earlier)
    with under("compare"):
        check_size(settings.loops.values(), settings.horizon)
    told = truth_told(study.wrist, settings.loops)
    return f"{searched}{count_rollouts(settings)} rollouts of {settings.horizon:g} s{told}"


def compare(session: Session) -> Compared:
    """Compare controllers on loops and references, beside the paper's numbers."""
    from wristctl.comparison.combinations import compare as run_comparison
    from wristctl.comparison.comparison_data import frame, repetitions_frame, series
    from wristctl.comparison.statistics import spread
    from wristctl.report.truth_table import truth_tables
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.draws import Draws

    study, findings, searches = session.study, session.findings, dict[str, "Search"]()
    settings = study.compare
    loops = settings.loops.values()
    warn_if_it_buckles(findings, study.wrist, loops)
    warn_if_coarse(loops)
    warn_outside_conditions(settings.rows, loops)
    network = network_for(session.inputs, study.wrist, loops)
    check_inverses(settings.inverses, network)
    if settings.tuning is not None:
        searches = search_all(session, study.model_copy(update={"tune": settings.tuning}), network)
    tuned = dict(tuned_gains(session.inputs) or {}) | {name: found.gains for name, found in searches.items()}
    with session.progress("comparing", total=100, unit="%") as done:
        results = run_comparison(study, network, tuned, lambda share: done(round(100 * share)))
    scenarios = [scenario_of(each, way) for each in settings.references for way in settings.directions]
    findings.note_streams(Draws(study.seed).names(loops, scenarios))
    findings.table("data/comparison.csv", frame(results), units=_units())
    findings.arrays("data/trajectories.npz", series(results))
    if any(len(result.repeated.failed) > 1 for result in results):
        findings.table("data/repetitions.csv", repetitions_frame(results), units=_units())
    for result in results:
        name = "_".join((result.loop, result.label, result.inverse, result.reference)).replace(" ", "-")
        found = spread(result.repeated.metrics["rmse"])
        findings.metric(f"rmse_{name}", found.median, "rad", "lower", found.n, found.interval)
    times = _step_times(session, tuned)
    with session.progress("drawing"):
        _draw(findings, settings, results)
    by_loop = [_loop_tables(loop, [r for r in results if r.loop == loop]) for loop in settings.loops]
    tables = [*chain.from_iterable(by_loop), _step_table(times), *truth_tables(study.wrist, settings.loops)]
    return Compared(study, findings, tables, results, searches, times)


def _step_times(session: Session, tuned: Gains) -> dict[str, StepTime]:
    from wristctl.comparison.step_cost import step_time
    from wristctl.control.table import controller, gains_of

    times = {}
    with session.progress("timing the control step"):
        for row in session.study.compare.rows:
            law = controller(row.controller)
            gains = gains_of(law, row.gains, tuned)
            times[f"{row.controller}/{row.gains_name}"] = step_time(law, gains, session.study.wrist)
    session.findings.plain("timing.json", {name: time._asdict() for name, time in times.items()})
    return times


def _draw(findings: Findings, settings: CompareSettings, results: list[ComparedRow]) -> None:
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


def _units() -> dict[str, str]:
    from wristctl.simulation.metrics import METRICS

    own = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in own.items() for end in ("low", "high")}
    return own | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


def _loop_tables(loop: str, results: list[ComparedRow]) -> list[Table]:
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


def _step_table(times: dict[str, StepTime]) -> Table:
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


COMPARE = Procedure(
    "compare",
    plan,
    compare,
    (EarlierRun("network", kind="train", optional=True), EarlierRun("tuned", kind="tune", optional=True)),
)
