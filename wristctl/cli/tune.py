"""`wristctl tune`: gains by search, the same budget and objective for every controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.control import TuneSettings
from wristctl.config.errors import UserError, under
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.tuning.search import Search


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """Check the controllers' names and say what the search costs."""
    settings = study.tune
    with under("tune"):
        check_search(settings)
    rollouts = settings.candidates * settings.iterations * len(settings.scenarios)
    return f"{rollouts} rollouts of {settings.horizon:g} s for each of {', '.join(settings.controllers)}"


def check_search(settings: TuneSettings) -> None:
    """UserError, naming the key, for an unknown controller, one without gains, or a scenario on an unknown loop."""
    from wristctl.control.table import controller
    from wristctl.tuning.search import check_loops, check_tunable

    check_loops(settings)
    for number, name in enumerate(settings.controllers):
        try:
            check_tunable(controller(name))
        except UserError as error:
            raise UserError(error.what, f"controllers.{number}", error.fix) from error


def tune(session: Session) -> Table:
    """Search for gains by rollouts, a whole swarm as one batch."""
    from wristctl.cli.loops import identified, warn_if_it_buckles

    session = identified(session, "tune")
    warn_if_it_buckles(session, session.settings.loops.values())
    found = search_all(session, session.settings)
    rows = [
        (name, result.objective, result.evaluations, "  ".join(f"{k} = {v:.4g}" for k, v in result.gains.items()))
        for name, result in found.items()
    ]
    return Table("Tuned gains", ("controller", "objective", "evaluations", "gains"), rows)


def search_all(session: Session, settings: TuneSettings) -> dict[str, Search]:
    """Tune every controller of the settings and keep in the run what was found, also where it is cut short."""
    import numpy as np

    from wristctl.cli.loops import network_of
    from wristctl.control.table import controller
    from wristctl.tuning.search import search

    study = session.study.model_copy(update={"tune": settings})
    network, found = network_of(session), {}
    try:
        for name in settings.controllers:
            rng = np.random.default_rng(session.run.stream(f"search {name}"))
            with session.progress(f"tuning {name}", total=settings.iterations, unit="iterations") as done:

                def so_far(result: Search, name: str = name, done: object = done) -> None:
                    found[name] = result
                    done(len(result.values), best=result.objective)  # type: ignore[operator]

                found[name] = search(study, controller(name), rng, network, so_far)
    finally:
        _keep(session, found)
    return found


def _keep(session: Session, found: dict[str, Search]) -> None:
    """Write what was found, also of a search that was cut short."""
    from wristctl.control.table import controller
    from wristctl.report.tuning_figures import convergence, gain_history
    from wristctl.tuning.gains_file import write_gains
    from wristctl.tuning.search import history

    if not found:
        return
    run = session.run
    write_gains(run.file("data/gains.json"), {name: result.gains for name, result in found.items()})
    for name, result in found.items():
        gains = controller(name).gains
        units = {"iteration": "1", "candidate": "1", "objective": "1"} | {k: g.unit or "1" for k, g in gains.items()}
        run.table(f"data/history-{name}.csv", history(result), units=units)
        run.metric(f"{name}_objective", result.objective, unit="", better="lower", n=result.evaluations)
        for gain, value in result.gains.items():
            run.metric(f"{name}_{gain}", value, unit=gains[gain].unit, better="", meaning=gains[gain].meaning)
        run.figure(f"gains-{name}", gain_history(result, gains))
    run.figure("convergence", convergence(list(found.values())))


app = study_command(
    "tune",
    work=tune,
    plan=plan,
    inputs=(
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
    ),
    shortcuts=("candidates", "iterations"),
    examples=(
        "wristctl tune experiments/paper.yaml",
        "wristctl tune --set 'controllers=[smc, pid]' --iterations 20",
        "wristctl tune experiments/paper.yaml --from-identified latest:identify",
    ),
)
