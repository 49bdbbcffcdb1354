"""Gains by search, the same budget and objective for every controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import FROM_IDENTIFIED, NETWORK, EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_search,
    check_family_reach,
    check_inverses,
    check_reach,
    check_searched,
    family_of,
    inverses_of,
    judged_loops,
    network_for,
    why_two_planes,
)
from wristctl.commands.loop_warnings import refuse_out_of_reach, warn_of_loops
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.commands.sweep.command import sweepable
from wristctl.config.loop import Reference
from wristctl.config.study import Study
from wristctl.errors import UserError, under

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.commands.tune.answer import Beside, Start
    from wristctl.simulation.closed_loop import Size
    from wristctl.tuning.margin import Stood
    from wristctl.tuning.search import Search


@dataclass(frozen=True, repr=False, eq=False)
class Tuned(StudyResult):
    """Result of the search of each controller."""

    kind = "tune"

    searches: dict[str, Search]
    """by controller"""
    lost: dict[str, dict[str, int]]
    """by controller, on how many of the cases that its best gains were chosen by they fail, swing, chatter or do not
    converge; empty where they never do"""
    errors: dict[str, Beside]
    """by controller, its error beside feedforward's on those cases"""
    cases: int
    """Number of those cases."""
    elsewhere: dict[str, dict[str, dict[str, int]]]
    """by controller and loop, on how many of the same motions its best gains are lost on loops that no scenario is
    on; none for a family of worlds"""
    stood: dict[str, Stood]
    """by controller, how much its best gains stand on the loop that they were tuned for"""
    bending: str
    """Planes that all loops bend in, a sentence; empty where they stay in one."""
    starts: dict[str, Start]
    """by controller, what its best preset is worth on those cases; of those for which better gains were found"""

    @property
    def answer(self) -> Answer | None:
        """Best gains, their error beside feedforward, and what they do wrong."""
        from wristctl.commands.ranking_answer import condition_of_loop
        from wristctl.commands.tune.answer import answer_of
        from wristctl.commands.tune.searches import motion_of

        motion = motion_of(self.study, self.place)
        found = self.searches, self.errors, self.lost, self.cases, self.place, self.elsewhere
        loops = self.study.tune.loops.items()
        conditions = {name: condition_of_loop(loop, self.study.wrist) for name, loop in loops}
        return answer_of(*found, motion, self.stood, self.bending, self.starts, conditions)

    @property
    def marks(self) -> list[str]:
        """Controllers whose best gains fail, swing, chatter or do not converge in some case."""
        return [f"{name}: {', '.join(marks)}" for name, marks in self.lost.items() if marks]

    @property
    def gains(self) -> dict[str, dict[str, float]]:
        """The best gains, by controller and name, in the units of the controller's table."""
        return {name: search.gains for name, search in self.searches.items()}

    def frame(self) -> pd.DataFrame:
        """Every candidate of every search: controller, iteration, candidate, objective, and the gains it has."""
        import pandas as pd

        from wristctl.tuning.search import history

        tables = {name: history(search) for name, search in self.searches.items()}
        return pd.concat(tables, names=["controller"]).reset_index("controller").reset_index(drop=True)


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controllers' names and say what the search costs."""
    from wristctl.commands.truth_table import truth_told

    identified_study = identified(study, "tune", inputs)
    with under("tune"):
        truth_text = truth_told(identified_study.wrist, judged_loops(study, study.tune))
        planned = planned_search(identified_study, inputs)
    check_family_reach(identified_study, study.tune.worlds.family)
    return planned + truth_text


def planned_search(study: Study, inputs: Inputs) -> str:
    """Cost of a study's search. Raises UserError, naming the key, for a controller or a scenario that it cannot have.

    That is an unknown controller, one without gains, a scenario on an unknown loop, an unknown family, or a network
    that none of the inputs is.
    """
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import check_size
    from wristctl.simulation.planes import planes_of
    from wristctl.tuning.search import check_loops, check_optimiser

    settings = study.tune
    check_searched(settings.controllers)
    try:
        check_optimiser(settings)
    except UserError as error:
        raise error.at(str(error.where).removeprefix("tune.")) from error
    references: Sequence[Reference] = [scenario.reference for scenario in settings.scenarios]
    if settings.worlds.family:
        references = family_of(study.families, settings.worlds.family, "worlds.family").references
    else:
        check_loops(settings)
    planes = planes_of(study.wrist, asked_of_search(study))
    if not settings.worlds.family:
        check_reach(references, study.wrist, "scenarios.{}.reference", planes)
    asked = size(study)
    check_size(asked, planes)
    check_inverses(inverses_of(references), inputs)
    times = {name: controller(name).learning for name in settings.controllers}
    told = f"{asked.rollouts // sum(times.values())} rollouts of {asked.horizon:g} s for each of {', '.join(times)}"
    return told + "".join(f", {n} times as many for {name}, which learns" for name, n in times.items() if n > 1)


def size(study: Study) -> Size:
    """Size of all searches of the study, every repetition that a controller learns from among its rollouts."""
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import Size
    from wristctl.simulation.worlds import is_random

    settings, families = study.tune, study.families
    repetitions = sum(controller(name).learning for name in settings.controllers)
    searched = settings.candidates * settings.iterations * settings.restarts * repetitions
    if settings.worlds.family:
        family = families[settings.worlds.family]
        return Size([family.loop], family.horizon, searched * settings.worlds.draws * len(family.references))
    loops = [settings.loops[scenario.loop] for scenario in settings.scenarios]
    rollouts = sum(settings.repetitions if is_random(loop) else 1 for loop in loops)
    return Size(loops, settings.horizon, searched * rollouts)


def tune(session: Session) -> Tuned:
    """Search for gains by rollouts, a whole swarm as one batch."""
    import numpy as np

    from wristctl.commands.truth_table import truth_tables
    from wristctl.commands.tune.answer import beside_feedforward, searches_table, starts_of
    from wristctl.commands.tune.searches import keep_files, margins, others_of, search_all, tried_elsewhere
    from wristctl.control.table import controller
    from wristctl.tuning.margin import LADDERS
    from wristctl.tuning.objective import marks_of
    from wristctl.tuning.search import own_loop, tuning_cases

    study = identified(session.study, "tune", session.inputs)
    loops = judged_loops(study, study.tune).values()
    warn_of_loops(session.findings, study, study.tune, asked_of_search(study))
    planes = 2 if why_two_planes(study.wrist, asked_of_search(study)) else 1
    network = network_for(session.inputs, study.wrist, loops, planes)
    searched, chosen = tuning_cases(study, network)
    cases = chosen or searched
    tried = 7 * len(cases) + sum(others_of(study).values()) + sum(map(len, LADDERS)) * len(searched)
    searches = search_all(session, study, network, tried)
    gains = {name: best.gains for name, best in searches.items()}
    with session.progress("trying the gains found"):
        laws = {name: controller(name) for name in gains}
        values = {name: np.array(law.values(gains[name])) for name, law in laws.items()}
        lost = {name: marks_of(law, values[name], cases, study.wrist) for name, law in laws.items()}
        errors, starts = beside_feedforward(gains, cases, study.wrist), starts_of(searches, cases, study.wrist)
    title = "Tuned gains, best first; objective in decades beside feedforward"
    tables = [searches_table(searches, errors, lost, len(cases), title)]
    tables += truth_tables(study.wrist, judged_loops(study, study.tune))
    elsewhere = tried_elsewhere(session, study, network, gains)
    stood = margins(session, own_loop(study, searched, network), gains)
    keep_files(session.findings, study, gains)
    bending = why_two_planes(study.wrist, asked_of_search(study))
    return Tuned(
        session.study, session.findings, tables, searches, lost, errors, len(cases), elsewhere, stood, bending, starts
    )


TUNE = sweepable(
    Procedure(
        "tune",
        plan,
        tune,
        (NETWORK, FROM_IDENTIFIED, EarlierRun("resume", kind="tune", optional=True, unfinished=True)),
        doubts=refuse_out_of_reach,
        size=size,
        in_one_plane=lambda study: not why_two_planes(study.wrist, asked_of_search(study)),
    )
)
