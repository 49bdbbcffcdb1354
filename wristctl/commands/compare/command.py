"""Controllers under the same conditions, beside the paper's numbers."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import FROM_IDENTIFIED, NETWORK, TUNED, Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_comparison,
    check_family_reach,
    check_inverses,
    check_reach,
    check_row,
    check_tuned,
    compared_inverses,
    family_of,
    judged_loops,
    network_for,
    tuned_gains,
    tuned_on,
    why_two_planes,
    with_what_there_is,
)
from wristctl.commands.loop_warnings import warn_of_earlier_families, warn_of_loops, warn_of_lost
from wristctl.commands.printed_table import joined
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.commands.step_times import after_rollouts, timed_steps
from wristctl.commands.sweep.command import sweepable
from wristctl.commands.tune.command import planned_search
from wristctl.config.choices import CONTROLLERS
from wristctl.config.controller_row import BY_LOOP, label_of
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError, under

log = logging.getLogger(__name__)

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from wristctl.comparison.combinations import ComparedRow
    from wristctl.comparison.controller_ranking import Ranking
    from wristctl.comparison.step_cost import StepTime
    from wristctl.control.law import Controller
    from wristctl.control.table import Gains
    from wristctl.simulation.closed_loop import Size
    from wristctl.tuning.search import Search


@dataclass(frozen=True, repr=False, eq=False)
class Compared(StudyResult):
    """Every combination of controller, loop, reference, direction and inverse."""

    kind = "compare"

    rows: list[ComparedRow]
    """Compared rows with the simulation of their loop."""
    searches: dict[str, Search]
    """Searches of the controllers that were tuned here, by name."""
    step_times: dict[str, StepTime]
    """Median and 99th percentile of a control step on this machine [us], by controller/gains."""
    rankings: Sequence[Ranking]
    """Rankings under each condition, or over the worlds of a named family: of its smooth motions, of its steps. `rows`
    is empty then."""
    gains: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Gains by name, in SI units, of every row, by controller/gains."""

    @property
    def fault(self) -> UserError | None:
        """Error of rankings over worlds in which every row is unreliable; None where some row stands."""
        worlds = [ranking for ranking in self.rankings if ranking.unit == "world"]
        if any(len(ranking.standing.unreliable) < len(ranking.labels) for ranking in worlds) or not worlds:
            return None
        reason, where = "every row fails, swings or chatters in some world", self.findings.run
        return UserError(reason, str(where.path) if where else "", "other gains, or milder worlds", exit_code=3)

    @property
    def answer(self) -> Answer | None:
        """Which controller to use under which condition, and which must not be used."""
        from wristctl.commands.compare.answer import answer_of

        bending = why_two_planes(self.study.wrist, asked_of_comparison(self.study))
        own = [row.label for row in self.study.compare.rows if CONTROLLERS.origin(row.controller)]
        typed = [row.label for row in self.study.compare.rows if row.gains == BY_LOOP]
        own_wrist = self.study.wrist != WristParameters() or self.study.compare.from_identified is not None
        return answer_of(self.rankings, self.place, self.gains, bending, [*own, *typed], own_wrist)

    @property
    def marks(self) -> list[str]:
        """Conditions in which no controller can be used, or none is ranked for want of cases."""
        from wristctl.commands.ranking_answer import condition

        unranked = [ranking for ranking in self.rankings if not ranking.standing.groups and not ranking.jumps]
        few = [condition(ranking) for ranking in unranked if ranking.standing.untold]
        none = [condition(ranking) for ranking in unranked if not ranking.standing.untold]
        return [
            f"{what}: {', '.join(where)}" for what, where in (("no usable one", none), ("no ranking", few)) if where
        ]

    def frame(self) -> pd.DataFrame:
        """One row per combination: every metric beside the paper's; of a ranking one per row, best first."""
        import pandas as pd

        from wristctl.commands.compare.csv_data import frame
        from wristctl.comparison.combinations import paper_cells
        from wristctl.comparison.world_ranking import WorldRanking, ranking_frame

        if worlds := [ranking for ranking in self.rankings if isinstance(ranking, WorldRanking)]:
            return pd.concat([ranking_frame(ranking) for ranking in worlds], ignore_index=True)
        return frame(self.rows, paper_cells(self.study))

    def at_a_point(self) -> tuple[Mapping[str, Sequence[Any]], Mapping[str, Mapping[str, Any]]]:
        """A row for each controller: RMSE [rad] under each condition, then on each loop in each motion.

        It is nan where the wrist left its range, and what is wrong with it is the row's `fate`.
        """
        from wristctl.commands.compare.answer import by_controller

        return by_controller(self.rankings, self.rows)

    def series(self) -> dict[str, np.ndarray]:
        """Courses over time, one row per combination, every fifth sample; SI units."""
        from wristctl.commands.compare.csv_data import series

        return dict(series(self.rows))

    def courses(self) -> Mapping[str, Mapping[str, Any]]:
        """Courses over time under the name of their file."""
        return {"series": self.series()}


def plan(study: Study, inputs: Inputs) -> str:
    """Check names and say how many rollouts there will be."""
    from wristctl.commands.truth_table import truth_told
    from wristctl.comparison.combinations import refuse_tuned_scenarios
    from wristctl.simulation.closed_loop import check_size
    from wristctl.simulation.planes import planes_of

    study, _ = with_what_there_is(identified(study, "compare", inputs), inputs)
    settings, earlier, searched = study.compare, tuned_on(inputs), ""
    found_here = settings.tuning.controllers if settings.tuning is not None else ()
    for number, row in enumerate(settings.rows):
        if row.gains != "tuned" or row.controller not in found_here:
            with under(f"compare.controllers.{number}"):
                check_row(row, tuned_gains(inputs), inputs.runs().get("tuned"))
    check_tuned(settings.rows, inputs)
    if settings.tuning is not None:
        check_family_reach(study, settings.tuning.worlds.family)
        with under("compare.tuning"):
            first = study.model_copy(update={"tune": settings.tuning})
            searched = f"a search first: {planned_search(first, inputs)}\n"
        if not any(row.gains == "tuned" and row.controller in found_here for row in settings.rows):
            what, one = f"gains of {joined(found_here)} would be searched, and no row has them", found_here[0]
            fix = f"gains: tuned in the row of {one}, or `wristctl compare {one} --tune`"
            raise UserError(what, "compare.tuning", fix)
        refuse_tuned_scenarios(settings, settings.tuning)
    if earlier is not None:
        refuse_tuned_scenarios(settings, earlier)
    check_family_reach(study, settings.worlds.family)
    with under("compare"):
        asked, planes = size(study), planes_of(study.wrist, asked_of_comparison(study))
        check_inverses(compared_inverses(study), inputs)
        check_size(asked, planes)
    if not settings.worlds.family:
        check_reach(settings.references, study.wrist, "compare.references.{}", planes)
    truth = truth_told(study.wrist, judged_loops(study, study.compare))
    return f"{searched}{asked.rollouts} rollouts of {asked.horizon:g} s{truth}"


def size(study: Study) -> Size:
    """Every row on every loop and reference, or on the worlds of a family."""
    from wristctl.comparison.combinations import count_rollouts
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import Size

    settings, loops = study.compare, list(judged_loops(study, study.compare).values())
    if settings.worlds.family:
        family = family_of(study.families, settings.worlds.family, "worlds.family")
        rows = sum(controller(row.controller).learning for row in settings.rows)
        return Size(loops, family.horizon, rows * settings.worlds.draws * len(family.references))
    return Size(loops, settings.horizon, count_rollouts(settings))


def compare(session: Session) -> Compared:
    """Compare controllers on loops and references, beside the paper's numbers, or rank them on a family of worlds."""
    from wristctl.commands.compare.answer import STANDING_UNITS, head_with_the_best, loop_tables, step_table, units
    from wristctl.commands.compare.csv_data import frame, repetitions_frame, series
    from wristctl.commands.compare.drawing import draw, ranked
    from wristctl.commands.ranking_tables import answer_tables, draw_rankings, every_row
    from wristctl.commands.truth_table import truth_tables
    from wristctl.commands.tune.searches import search_all
    from wristctl.comparison.combinations import compare as run_comparison
    from wristctl.comparison.combinations import paper_cells
    from wristctl.comparison.controller_ranking import class_rankings, standings_frame
    from wristctl.comparison.repetition_spread import spread
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.planes import planes_of
    from wristctl.simulation.worlds import Draws

    study, left_out = with_what_there_is(identified(session.study, "compare", session.inputs), session.inputs)
    findings, searches = session.findings, dict[str, "Search"]()
    if left_out:
        log.warning("left out: %s", "; ".join(left_out))
    settings = study.compare
    loops = judged_loops(study, study.compare).values()
    warn_of_earlier_families(settings.rows)
    warn_of_loops(findings, study, settings, asked_of_comparison(study))
    network = network_for(session.inputs, study.wrist, loops, planes_of(study.wrist, asked_of_comparison(study)))
    if settings.tuning is not None:
        tuning = study.model_copy(update={"tune": settings.tuning})
        later = size(study).rollouts * settings.horizon / settings.tuning.horizon / len(settings.tuning.controllers)
        searches = search_all(session, tuning, network, later)
    tuned = dict(tuned_gains(session.inputs) or {}) | {name: search.gains for name, search in searches.items()}
    gains = _gains_of_rows(study, tuned)
    if settings.worlds.family:
        of_worlds = ranked(session, study, network, tuned)
        warn_of_lost(settings.rows, loops, of_worlds)
        head_with_the_best(findings, of_worlds)
        draw_rankings(findings, of_worlds)
        times = timed_steps(session, _laws_of_rows(study, tuned))
        shown = [*answer_tables(of_worlds), *(every_row(ranking, times) for ranking in of_worlds)]
        return Compared(study, findings, shown, [], searches, times, of_worlds, gains)
    with session.progress("comparing", 100, "%", after=after_rollouts(len(settings.rows))) as report:
        results = run_comparison(study, network, tuned, lambda share: report(round(100 * share)))
    scenarios = [scenario_of(reference, way) for reference in settings.references for way in settings.directions]
    findings.note_streams(Draws(study.seed).names(loops, scenarios))
    cells = paper_cells(study)
    findings.table("data/comparison.csv", frame(results, cells), units=units())
    findings.arrays("data/trajectories.npz", series(results))
    if any(len(result.repeated.failed) > 1 for result in results):
        findings.table("data/repetitions.csv", repetitions_frame(results), units=units())
    for result in results:
        name = "_".join((result.loop, result.label, result.inverse, result.reference)).replace(" ", "-")
        rmse = spread(result.repeated.metrics["rmse"])
        findings.metric(f"rmse_{name}", rmse.median, "rad", "lower", rmse.n, rmse.interval)
    rankings = class_rankings(results, settings, study.wrist)
    warn_of_lost(settings.rows, loops, rankings)
    findings.table("data/standings.csv", standings_frame(rankings), units=STANDING_UNITS)
    head_with_the_best(findings, rankings)
    times = timed_steps(session, _laws_of_rows(study, tuned))
    with session.drawing():
        draw(findings, study, results, rankings)
    by_loop = [loop_tables(loop, [r for r in results if r.loop == loop], cells) for loop in settings.loops]
    tables = [
        *answer_tables(rankings),
        *chain.from_iterable(by_loop),
        step_table(times),
        *truth_tables(study.wrist, settings.loops),
    ]
    return Compared(study, findings, tables, results, searches, times, rankings, gains)


def _gains_of_rows(study: Study, tuned: Gains) -> dict[str, dict[str, float]]:
    """Gains by name of every row, by its label; of gains by loop those of each preset, by controller/preset."""
    from wristctl.control.table import controller, gains_of, preset_for

    laws: dict[str, tuple[Controller, str | Mapping[str, float]]] = {}
    for row in study.compare.rows:
        law = controller(row.controller)
        if row.gains != BY_LOOP:
            laws[row.label] = law, row.gains
            continue
        for loop in judged_loops(study, study.compare).values():
            preset = preset_for(law, loop.is_exact)
            laws[label_of(row.controller, preset)] = law, preset
    return {
        label: dict(zip(law.gains, gains_of(law, gains, tuned), strict=True)) for label, (law, gains) in laws.items()
    }


def _laws_of_rows(study: Study, tuned: Gains) -> dict[str, tuple[Controller, tuple[float, ...]]]:
    """Controller and gains of every row, by its label; of gains by loop those of the first one."""
    from wristctl.control.table import controller, gains_of

    first = next(iter(judged_loops(study, study.compare).values()))
    laws = {row.label: (controller(row.controller), row.gains) for row in study.compare.rows}
    return {label: (law, gains_of(law, gains, tuned, first)) for label, (law, gains) in laws.items()}


COMPARE = sweepable(
    Procedure(
        "compare",
        plan,
        compare,
        (NETWORK, TUNED, FROM_IDENTIFIED),
        size=size,
        in_one_plane=lambda study: not why_two_planes(study.wrist, asked_of_comparison(study)),
    )
)
