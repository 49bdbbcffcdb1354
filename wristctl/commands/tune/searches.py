"""The searches of a study's tune section, which `tune` and `compare` run: noted, resumed, and kept as they go."""

from __future__ import annotations

from wristctl.commands.results import Findings
from wristctl.commands.session import Done, Session
from wristctl.config.study import Study
from wristctl.control.table import controller, write_gains
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.drawn_worlds import streams_of
from wristctl.simulation.worlds import Draws
from wristctl.tuning.margin import CHANGES
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import Search, Tried, finalists, history, judges_of, search, tried_of
from wristctl.wrist.kinematics import Inverse

# Time of a rollout at short steps over that of a search's; rollouts whose time an iteration takes beside those that it
# runs; candidates of it that are looked at closely.
_CLOSELY, _BESIDE, _PROMISING = 1.2, 20, 2
# Seconds that the figures of a controller take.
_DRAWN = 1.0


def search_all(session: Session, study: Study, network: Inverse | None, then: float = 0.0) -> dict[str, Search]:
    """Tune every controller of the study's tune section; what was found is kept also where it is cut short.

    `then` are the rollouts that the command runs after it, for each controller.
    """
    settings = study.tune
    _note_streams(session, study)
    judge, choose = judges_of(study, network)
    laws = {name: controller(name) for name in settings.controllers}
    total, searches = settings.iterations * settings.restarts, dict[str, "Search"]()
    closely = _CLOSELY * judge.count + len(CHANGES) * judge.own_loop.count
    searched = total * (settings.candidates * judge.count + _PROMISING * closely + _BESIDE)
    choice = _CLOSELY * min(settings.finalists, total * settings.candidates) * (choose or judge).count / searched
    rest = _CLOSELY * then / searched * sum(law.learning for law in laws.values())
    drawn = _DRAWN * len(laws)
    try:
        for number, (name, law) in enumerate(laws.items(), start=1):
            later = sum(other.learning for other in list(laws.values())[number:])
            following = choice + ((1.0 + choice) * later + rest) / law.learning
            with session.progress(f"tuning {name}", total, "iterations", following, drawn) as advance:

                def so_far(result: Search, name: str = name, report: Done = advance) -> None:
                    searches[name] = result
                    report(len(result.tried.values), best=result.objective)

                tried = _known(session, name)
                after_choice = ((1.0 + 1.0 / choice) * later + rest / choice) / law.learning
                choosing = session.progress(f"choosing gains of {name}", 100, "%", after_choice, drawn)
                searches[name] = search(study, law, session.findings.stream, (judge, choose), so_far, tried, choosing)
    finally:
        _keep(session.findings, searches, choose or judge)
    return searches


def _note_streams(session: Session, study: Study) -> None:
    settings = study.tune
    if settings.worlds.family:
        name = settings.worlds.family
        for split in ("tune", "validation"):
            session.findings.note_streams(streams_of(study.families[name], name, split))
        return
    for purpose in ("tuning", "validation"):
        draws = Draws(study.seed, purpose)
        for scenario in settings.scenarios:
            name = scenario_of(scenario.reference, "ulnar")
            session.findings.note_streams(draws.names([settings.loops[scenario.loop]], [name]))


def _known(session: Session, name: str) -> Tried | None:
    """Gains of a controller that the run to resume has tried."""
    stopped = session.inputs.runs().get("resume")
    if stopped is None or not stopped.has(f"data/history-{name}.csv"):
        return None
    return tried_of(stopped.data(f"history-{name}"), list(controller(name).gains))


def _keep(findings: Findings, searches: dict[str, Search], judge: Judge) -> None:
    """Keep what was found, also of a search that was cut short."""
    from wristctl.commands.tune.figures import convergence, gain_history, tornado

    if not searches:
        return
    if file := findings.file("data/gains.json"):
        write_gains(file, {name: result.gains for name, result in searches.items()})
    for name, result in searches.items():
        gains = controller(name).gains
        units = {k: g.unit or "1" for k, g in gains.items()}
        counted = dict.fromkeys(("restart", "iteration", "candidate", "objective"), "1")
        findings.table(f"data/history-{name}.csv", history(result), units=counted | units)
        if result.finalists:
            judged = dict.fromkeys(("origin", "objective", "validated"), "1")
            findings.table(f"data/finalists-{name}.csv", finalists(result), units=judged | units)
        findings.metric(f"{name}_objective", result.objective, unit="", better="lower", n=result.evaluations)
        for gain, value in result.gains.items():
            findings.metric(f"{name}_{gain}", value, unit=gains[gain].unit, better="", meaning=gains[gain].meaning)
        findings.figure(f"gains-{name}", gain_history, result, gains, caption=f"Gains of {name} over the search")
        caption = f"What one gain of {name} by itself does to the objective"
        findings.figure(f"gain-sensitivity-{name}", tornado, name, result.gains, judge, caption=caption, later=True)
    findings.headline(*(f"{name}_objective" for name in sorted(searches, key=lambda name: searches[name].objective)))
    findings.figure("convergence", convergence, list(searches.values()), caption="Best objective against the budget")
