"""Gains by search, the same budget and objective for every controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.control import TuneSettings
from wristctl.config.errors import UserError, under
from wristctl.config.study import Study
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Findings
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.loop_inputs import check_inverses, identified, inverses_of, network_for
from wristctl.studies.loop_warnings import warn_if_coarse, warn_if_it_buckles
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Done, Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.tuning.search import Search
    from wristctl.wrist.kinematics import Inverse


@dataclass(frozen=True, repr=False, eq=False)
class Tuned(StudyResult):
    """What the search of each controller found."""

    kind = "tune"

    searches: dict[str, Search]
    """by controller"""

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
    from wristctl.report.truth_table import truth_told

    with under("tune"):
        told = truth_told(identified(study, "tune", inputs).wrist, study.tune.loops)
        return planned_search(study.tune) + told


def planned_search(settings: TuneSettings) -> str:
    """What a search costs. UserError, naming the key, for a controller or a scenario that it cannot have.

    That is an unknown controller, one without gains, or a scenario on an unknown loop.
    """
    from wristctl.control.table import controller
    from wristctl.simulation.draws import is_random
    from wristctl.simulation.size import check_size
    from wristctl.tuning.search import check_loops, check_tunable

    check_loops(settings)
    check_size(settings.loops.values(), settings.horizon)
    for number, name in enumerate(settings.controllers):
        try:
            check_tunable(controller(name))
        except UserError as error:
            raise error.at(f"controllers.{number}") from error
    loops = [settings.loops[scenario.loop] for scenario in settings.scenarios]
    each = sum(settings.repetitions if is_random(loop) else 1 for loop in loops)
    rollouts = settings.candidates * settings.iterations * each
    return f"{rollouts} rollouts of {settings.horizon:g} s for each of {', '.join(settings.controllers)}"


def tune(session: Session) -> Tuned:
    """Search for gains by rollouts, a whole swarm as one batch."""
    from wristctl.report.truth_table import truth_tables

    study = identified(session.study, "tune", session.inputs)
    loops = study.tune.loops.values()
    warn_if_it_buckles(session.findings, study.wrist, loops)
    warn_if_coarse(loops)
    network = network_for(session.inputs, study.wrist, loops)
    found = search_all(session, study, network)
    rows = [
        (name, result.objective, result.evaluations, "  ".join(f"{k} = {v:.4g}" for k, v in result.gains.items()))
        for name, result in found.items()
    ]
    tables = [Table("Tuned gains", ("controller", "objective", "evaluations", "gains"), rows)]
    tables += truth_tables(study.wrist, study.tune.loops)
    return Tuned(session.study, session.findings, tables, found)


def search_all(session: Session, study: Study, network: Inverse | None) -> dict[str, Search]:
    """Tune every controller of the study's tune section; what was found is kept also where it is cut short."""
    import numpy as np

    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.draws import Draws
    from wristctl.tuning.search import search

    settings = study.tune
    check_inverses(inverses_of(scenario.reference for scenario in settings.scenarios), network)
    draws = Draws(study.seed, "tuning")
    for scenario in settings.scenarios:
        name = scenario_of(scenario.reference, "ulnar")
        session.findings.note_streams(draws.names([settings.loops[scenario.loop]], [name]))
    found: dict[str, Search] = {}
    try:
        for name in settings.controllers:
            rng = np.random.default_rng(session.findings.stream(f"search {name}"))
            with session.progress(f"tuning {name}", total=settings.iterations, unit="iterations") as done:

                def so_far(result: Search, name: str = name, done: Done = done) -> None:
                    found[name] = result
                    done(len(result.values), best=result.objective)

                found[name] = search(study, controller(name), rng, network, so_far)
    finally:
        _keep(session.findings, found)
    return found


def _keep(findings: Findings, found: dict[str, Search]) -> None:
    """Keep what was found, also of a search that was cut short."""
    from wristctl.control.table import controller
    from wristctl.report.tuning_figures import convergence, gain_history
    from wristctl.tuning.gains_file import write_gains
    from wristctl.tuning.search import history

    if not found:
        return
    if file := findings.file("data/gains.json"):
        write_gains(file, {name: result.gains for name, result in found.items()})
    for name, result in found.items():
        gains = controller(name).gains
        units = {"iteration": "1", "candidate": "1", "objective": "1"} | {k: g.unit or "1" for k, g in gains.items()}
        findings.table(f"data/history-{name}.csv", history(result), units=units)
        findings.metric(f"{name}_objective", result.objective, unit="", better="lower", n=result.evaluations)
        for gain, value in result.gains.items():
            findings.metric(f"{name}_{gain}", value, unit=gains[gain].unit, better="", meaning=gains[gain].meaning)
        findings.figure(f"gains-{name}", gain_history, result, gains)
    findings.figure("convergence", convergence, list(found.values()))


TUNE = Procedure(
    "tune",
    plan,
    tune,
    (
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
    ),
)
