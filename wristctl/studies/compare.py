"""Controllers under the same conditions, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

from wristctl.config.errors import UserError, under
from wristctl.config.study import Study
from wristctl.studies.compare_answer import answer_lines, head_with_the_best
from wristctl.studies.compare_outputs import STANDING_UNITS, loop_tables, step_table, units
from wristctl.studies.compare_pictures import draw
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.loop_inputs import (
    check_family_reach,
    check_inverses,
    check_reach,
    check_row,
    compared_inverses,
    family_of,
    judged_loops,
    network_for,
    tuned_gains,
    tuned_on,
)
from wristctl.studies.loop_warnings import warn_if_coarse, warn_if_it_buckles, warn_outside_conditions
from wristctl.studies.out_of_reach import asked_by, warn_out_of_reach
from wristctl.studies.procedure import Procedure
from wristctl.studies.rank import ranked
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult
from wristctl.studies.sweep import sweepable
from wristctl.studies.tune import planned_search, search_all

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from wristctl.comparison.class_standing import ClassStanding
    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.step_cost import StepTime
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.simulation.size import Size
    from wristctl.tuning.gains_file import Gains
    from wristctl.tuning.search import Search


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
    standings: list[ClassStanding]
    """of the rows in each class of conditions, or over the worlds of a family"""
    rankings: Sequence[WorldRanking] = ()
    """over the worlds of a family, where one is named: of its smooth motions, of its steps; there are no `rows` then"""

    @property
    def fault(self) -> UserError | None:
        """That nothing in a ranking can be relied on."""
        if any(len(found.standing.unreliable) < len(found.rows) for found in self.rankings) or not self.rankings:
            return None
        what, where = "every row fails, swings or chatters in some world", self.findings.run
        return UserError(what, str(where.path) if where else "", "other gains, or milder worlds", exit_code=3)

    @property
    def answer(self) -> list[str]:
        """Which row is best in each class of conditions, in words."""
        return answer_lines(self.standings)

    def frame(self) -> pd.DataFrame:
        """One row per combination: every metric beside the paper's; of a ranking one per row, best first."""
        import pandas as pd

        from wristctl.comparison.comparison_data import frame
        from wristctl.comparison.paper_cells import paper_cells
        from wristctl.comparison.world_ranking import ranking_frame

        if self.rankings:
            return pd.concat([ranking_frame(found) for found in self.rankings], ignore_index=True)
        return frame(self.rows, paper_cells(self.study))

    def series(self) -> dict[str, np.ndarray]:
        """Courses over time, one row per combination, every fifth sample; SI units."""
        from wristctl.comparison.comparison_data import series

        return dict(series(self.rows))


def plan(study: Study, inputs: Inputs) -> str:
    """Check names and say how many rollouts there will be."""
    from wristctl.comparison.combinations import refuse_tuned_scenarios
    from wristctl.report.truth_table import truth_told
    from wristctl.simulation.size import check_size

    settings, earlier, searched = study.compare, tuned_on(inputs), ""
    found_here = settings.tuning.controllers if settings.tuning is not None else ()
    for number, row in enumerate(settings.rows):
        if row.gains != "tuned" or row.controller not in found_here:
            with under(f"compare.rows.{number}"):
                check_row(row, tuned_gains(inputs), inputs.runs().get("tuned"))
    if settings.tuning is not None:
        check_family_reach(study, settings.tuning.worlds.family)
        with under("compare.tuning"):
            searched = f"a search first: {planned_search(settings.tuning, study.families, study.wrist, inputs)}\n"
        refuse_tuned_scenarios(settings, settings.tuning)
    if earlier is not None:
        refuse_tuned_scenarios(settings, earlier)
    check_family_reach(study, settings.worlds.family)
    if not settings.worlds.family:
        check_reach(settings.references, study.wrist, "compare.references.{}")
    with under("compare"):
        asked = size(study)
        check_inverses(compared_inverses(study), inputs)
        check_size(asked)
    told = truth_told(study.wrist, judged_loops(study, study.compare))
    return f"{searched}{asked.rollouts} rollouts of {asked.horizon:g} s{told}"


def size(study: Study) -> Size:
    """Every row on every loop and reference, or on the worlds of a family."""
    from wristctl.comparison.combinations import count_rollouts
    from wristctl.simulation.size import Size

    settings, loops = study.compare, list(judged_loops(study, study.compare).values())
    if settings.worlds.family:
        family = family_of(study.families, settings.worlds.family, "worlds.family")
        return Size(loops, family.horizon, len(settings.rows) * settings.worlds.draws * len(family.references))
    return Size(loops, settings.horizon, count_rollouts(settings))


def compare(session: Session) -> Compared:
    """Compare controllers on loops and references, beside the paper's numbers, or rank them on a family of worlds."""
    from wristctl.comparison.class_standing import class_standings, of_ranking, standings_frame
    from wristctl.comparison.combinations import compare as run_comparison
    from wristctl.comparison.comparison_data import frame, repetitions_frame, series
    from wristctl.comparison.paper_cells import paper_cells
    from wristctl.comparison.statistics import spread
    from wristctl.report.truth_table import truth_tables
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.draws import Draws

    study, findings, searches = session.study, session.findings, dict[str, "Search"]()
    settings = study.compare
    loops = judged_loops(study, study.compare).values()
    warn_if_it_buckles(findings, study.wrist, loops)
    warn_if_coarse(loops)
    warn_outside_conditions(settings.rows, loops)
    warn_out_of_reach(findings, study.wrist, asked_by(study, settings))
    network = network_for(session.inputs, study.wrist, loops)
    if settings.tuning is not None:
        searches = search_all(session, study.model_copy(update={"tune": settings.tuning}), network)
    tuned = dict(tuned_gains(session.inputs) or {}) | {name: found.gains for name, found in searches.items()}
    if settings.worlds.family:
        rankings, shown = ranked(session, study, network, tuned)
        stands = [of_ranking(ranking) for ranking in rankings]
        head_with_the_best(findings, stands)
        return Compared(study, findings, shown, [], searches, {}, stands, rankings)
    with session.progress("comparing", total=100, unit="%") as done:
        results = run_comparison(study, network, tuned, lambda share: done(round(100 * share)))
    scenarios = [scenario_of(each, way) for each in settings.references for way in settings.directions]
    findings.note_streams(Draws(study.seed).names(loops, scenarios))
    cells = paper_cells(study)
    findings.table("data/comparison.csv", frame(results, cells), units=units())
    findings.arrays("data/trajectories.npz", series(results))
    if any(len(result.repeated.failed) > 1 for result in results):
        findings.table("data/repetitions.csv", repetitions_frame(results), units=units())
    for result in results:
        name = "_".join((result.loop, result.label, result.inverse, result.reference)).replace(" ", "-")
        found = spread(result.repeated.metrics["rmse"])
        findings.metric(f"rmse_{name}", found.median, "rad", "lower", found.n, found.interval)
    standings = class_standings(results, settings, study.wrist)
    findings.table("data/standings.csv", standings_frame(standings), units=STANDING_UNITS)
    head_with_the_best(findings, standings)
    times = _step_times(session, tuned)
    with session.progress("drawing"):
        draw(findings, study, results, standings)
    by_loop = [loop_tables(loop, [r for r in results if r.loop == loop], cells) for loop in settings.loops]
    tables = [*chain.from_iterable(by_loop), step_table(times), *truth_tables(study.wrist, settings.loops)]
    return Compared(study, findings, tables, results, searches, times, standings)


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


COMPARE = sweepable(
    Procedure(
        "compare",
        plan,
        compare,
        (EarlierRun("network", kind="train", optional=True), EarlierRun("tuned", kind="tune", optional=True)),
        size=size,
    )
)
