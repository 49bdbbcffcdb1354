"""`wristctl compare`: controllers under the same conditions, beside the paper's numbers."""

from __future__ import annotations

import json
from itertools import chain
from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.errors import under
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.comparison.comparison import ComparedRow
    from wristctl.comparison.step_cost import StepTime

_DETAILED = 3
"""Comparisons of more loops than this draw the details of the first only."""

_SHOWN = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")
_HEADS = ("RMSE [rad]", "settling [s]", "steady [rad]", "overshoot [%]", "chattering [N/s]", "peak [N]", "saturated")


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """Check names and say how many rollouts there will be."""
    from wristctl.cli.loops import check_row, tuned_of, tuned_study
    from wristctl.cli.tune import check_search
    from wristctl.comparison.comparison import refuse_tuned_scenarios

    settings, earlier, tuned = study.compare, tuned_study(inputs), tuned_of(inputs)
    found_here = settings.tuning.controllers if settings.tuning is not None else ()
    for number, row in enumerate(settings.rows):
        if row.gains != "tuned" or row.controller not in found_here:
            with under(f"compare.rows.{number}"):
                check_row(row, tuned)
    if settings.tuning is not None:
        with under("compare.tuning"):
            check_search(settings.tuning)
        refuse_tuned_scenarios(settings, settings.tuning)
    if earlier is not None:
        refuse_tuned_scenarios(settings, earlier.tune)
    count = len(settings.rows) * len(settings.loops) * len(settings.references) * len(settings.inverses)
    return f"{count} rollouts of {settings.horizon:g} s"


def compare(session: Session) -> list[Table]:
    """Compare controllers on loops and references, beside the paper's numbers."""
    from wristctl.cli.loops import network_of, tuned_of, warn_if_it_buckles
    from wristctl.cli.tune import search_all
    from wristctl.comparison.comparison import compare as run_comparison
    from wristctl.comparison.comparison_data import frame, series
    from wristctl.comparison.step_cost import step_time
    from wristctl.control.table import controller, gains_of

    run, settings = session.run, session.settings
    warn_if_it_buckles(session, settings.loops.values())
    tuned = dict(tuned_of(session.inputs) or {})
    if settings.tuning is not None:
        tuned |= {name: found.gains for name, found in search_all(session, settings.tuning).items()}
    with session.progress("comparing", total=100, unit="%") as done:
        results = run_comparison(session.study, network_of(session), tuned, lambda share: done(round(100 * share)))
    run.table("data/comparison.csv", frame(results), units=_units())
    run.arrays("data/trajectories.npz", series(results))
    for result in results:
        name = "_".join((result.loop, result.label, result.inverse, result.reference)).replace(" ", "-")
        run.metric(f"rmse_{name}", result.simulation.metrics["rmse"], "rad", "lower")
    cost = {}
    with session.progress("timing the control step"):
        for row in settings.rows:
            law = controller(row.controller)
            gains = gains_of(law, row.gains, tuned)
            cost[f"{row.controller}/{row.gains_name}"] = step_time(law, gains, session.study.wrist)
    run.file("timing.json").write_text(json.dumps({k: t._asdict() for k, t in cost.items()}, indent=2) + "\n")
    with session.progress("drawing"):
        _draw(session, results)
    tables = [_table(loop, [r for r in results if r.loop == loop]) for loop in settings.loops]
    return [*chain.from_iterable(tables), _cost_table(cost)]


def _draw(session: Session, results: list[ComparedRow]) -> None:
    """Over the loops RMSE for each reference, and angles; for each loop (of many only the first) the same over the
    references, chattering, and the errors over time of each of the paper's controllers."""
    from wristctl.comparison.paper import T2
    from wristctl.report.compare_figures import angle_grid, chattering_bars, rmse_map
    from wristctl.report.loop_figures import errors

    run, settings = session.run, session.settings
    loops = list(settings.loops)
    if len(loops) > 1:
        for number, reference in enumerate(dict.fromkeys(r.reference for r in results), start=1):
            own = [r for r in results if r.reference == reference]
            run.figure(f"robustness-{number}", rmse_map(own, reference, "loop"))
        move = next((r.reference for r in results if not r.reference.startswith("step")), results[0].reference)
        own = [r for r in results if r.reference == move and r.inverse == settings.inverses[0]]
        run.figure("angles", angle_grid(own, move, "loop"))
    for loop in loops if len(loops) <= _DETAILED else loops[:1]:
        here = [r for r in results if r.loop == loop]
        first = [r for r in here if r.inverse == settings.inverses[0]]
        run.figure(f"angles-{loop}", angle_grid(first, f"loop {loop}"))
        run.figure(f"rmse-{loop}", rmse_map(here, f"loop {loop}"))
        run.figure(f"chattering-{loop}", chattering_bars(here, f"loop {loop}"))
        moves = [r for r in first if not r.reference.startswith("step")] or first
        shown = [r for r in moves if r.reference == moves[0].reference]
        for name in T2:
            courses = [r.simulation.trajectory for r in shown if r.controller == name]
            if courses:
                heading = f"{name}, loop {loop}, {shown[0].reference}"
                run.figure(f"error-{name}-{loop}", errors(courses, heading))
                run.figure(f"error-log-{name}-{loop}", errors(courses, heading, log=True))


def _units() -> dict[str, str]:
    from wristctl.simulation.metrics import METRICS

    own = {name: metric.unit or "1" for name, metric in METRICS.items()}
    extra = {"rmse_desired": "rad", "tip_rmse_mm": "mm", "tip_steady_mm": "mm", "outside_domain": "1"}
    paper = {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}
    return own | extra | paper


def _table(loop: str, results: list[ComparedRow]) -> list[Table]:
    """A table for each reference on one loop."""
    tables = []
    for reference in dict.fromkeys(result.reference for result in results):
        rows = [_row(result) for result in results if result.reference == reference]
        heads = ("controller", "inverse", *_HEADS, "paper's", "verdict")
        tables.append(Table(f"Loop {loop}, {reference}", heads, rows))
    return tables


def _row(result: ComparedRow) -> tuple[str | float, ...]:
    metrics = result.simulation.metrics
    never = "diverged" if result.simulation.failed else "never"
    settling = metrics["settling"] if metrics["settling"] == metrics["settling"] else never
    values = [settling if name == "settling" else metrics[name] for name in _SHOWN]
    return (result.label, result.inverse, *values, *_paper(result))


def _cost_table(cost: dict[str, StepTime]) -> Table:
    rows = [(label, time.median, time.p99) for label, time in cost.items()]
    return Table("Control step of one wrist on this machine", ("controller", "median [us]", "p99 [us]"), rows)


def _paper(result: ComparedRow) -> tuple[str, str]:
    from wristctl.comparison.paper import T2, verdict

    if result.controller not in T2:
        return "", ""
    metrics = result.simulation.metrics
    printed = " / ".join(f"{value:g}" for value in T2[result.controller])
    return printed, verdict(result.controller, metrics["rmse"], metrics["settling"], metrics["steady_state"])


app = study_command(
    "compare",
    work=compare,
    plan=plan,
    inputs=(EarlierRun("network", kind="train", optional=True), EarlierRun("tuned", kind="tune", optional=True)),
    shortcuts=("horizon",),
    examples=(
        "wristctl compare experiments/paper.yaml --network latest:train --tuned latest:tune",
        "wristctl compare --set 'inverses=[none]' --set 'rows=[{controller: computed-torque, gains: default}]'",
    ),
)
