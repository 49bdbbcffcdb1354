"""The searches of a study's tune section, which `tune` and `compare` run: noted, resumed, and kept as they go."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from wristctl.commands.inputs_of_loops import judged_loops
from wristctl.commands.kept_studies import asked_for, file_of, gains_content, hw_run_fits, keep_study, rig_of, row_of
from wristctl.commands.results import Findings
from wristctl.commands.session import Done, Session
from wristctl.commands.tune.answer import Motion
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.control.table import controller, write_gains
from wristctl.processes import cores
from wristctl.simulation.closed_loop import Size, scenario_of
from wristctl.simulation.drawn_worlds import streams_of
from wristctl.simulation.worlds import Draws, is_random
from wristctl.tuning.margin import CHANGES, OwnLoop, Stood
from wristctl.tuning.objective import Judge, marks_of
from wristctl.tuning.search import Search, Tried, finalists, history, judges_of, search, tried_of, tuning_cases
from wristctl.wrist.kinematics import Inverse

# Time of a rollout at short steps over that of a search's; rollouts whose time an iteration takes beside those that it
# runs; candidates of it that are looked at closely.
_CLOSELY, _BESIDE, _PROMISING = 1.2, 20, 2
# Seconds that the figures of a controller take, and in which its margins are found.
_DRAWN, _MARGINS = 1.0, 0.1
# Rollouts that a core takes at once in the time of these many.
_TOGETHER = 3
# Share of what a family draws at which one of its motions is tried.
_WITHIN = 0.75


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


def motion_of(study: Study, run: str) -> Motion:
    """One motion of those that gains were searched on: of a family its loop, and a motion within what is drawn."""
    settings, family = study.tune, study.families.get(study.tune.worlds.family)
    loops, horizon = judged_loops(study, settings), settings.horizon
    if family is not None:
        name, horizon = settings.worlds.family, family.horizon
        reference = family.motion(0, dict.fromkeys(family.draw, _WITHIN))
    else:
        name, reference = settings.scenarios[0].loop, settings.scenarios[0].reference
        loops = {scenario.loop: loops[scenario.loop] for scenario in settings.scenarios}
    where = f"the loop {name}" if family is None else f"the loop of the worlds {name}"
    through = settings.network if settings.network and reference.inverse == "network" else ""
    network = str(Path(run).parent / through) if through else ""
    return Motion(name, loops, reference, horizon, where, hw_run_fits(study, loops[name]), network)


def keep_files(findings: Findings, study: Study, gains: Mapping[str, Mapping[str, float]]) -> None:
    """A study file for each controller: its gains, and what they were searched on."""
    tried = motion_of(study, "")
    loops = {name: loop.model_dump(mode="json") for name, loop in tried.loops.items()}
    asked = {"loop": loops[tried.name], "reference": asked_for(tried.reference), "horizon": tried.horizon}
    trial = rig_of(tried.loops[tried.name]) if tried.on_a_rig else {}
    for name, values in gains.items():
        title = f"{name}, as `wristctl tune` found it on {tried.where}: wristctl simulate THIS"
        rows = [row_of(name, values)]
        content = gains_content(study, rows, simulate=asked, compare={"loops": loops}, hw_run=trial)
        keep_study(findings, file_of(name), title, content)


def margins(session: Session, own: OwnLoop, gains: Mapping[str, Mapping[str, float]]) -> dict[str, Stood]:
    """How much the gains of each controller stand on the loop that they were tuned for, kept as a table."""
    stood = dict[str, "Stood"]()
    with session.progress("looking for margins", total=len(gains), unit="controllers") as advance:
        for number, (name, values) in enumerate(gains.items(), start=1):
            law = controller(name)
            stood[name] = own.stood(law, np.array(law.values(values)))
            advance(number)
    if stood:
        rows = [{"controller": name, **changes._asdict()} for name, changes in stood.items()]
        session.findings.table("data/margins.csv", pd.DataFrame(rows), units=dict.fromkeys(rows[0], "1"))
    return stood


def others_of(study: Study) -> dict[str, float]:
    """The loops that no scenario is on, on which gains are tried: of each its time, in rollouts of the search.

    There are few rollouts of each, which share no core with others.
    """
    settings = study.tune
    if settings.worlds.family:
        return {}
    on = [scenario.loop for scenario in settings.scenarios]
    rollout = sum(_effort(settings.loops[name], settings.horizon) for name in on) / len(on)
    others = {name: loop for name, loop in settings.loops.items() if name not in on}
    cases = {name: len(on) * (settings.repetitions if is_random(loop) else 1) for name, loop in others.items()}
    return {
        name: max(cases[name], _TOGETHER * cores()) * _effort(loop, settings.horizon) / rollout
        for name, loop in others.items()
    }


def _effort(loop: Loop, horizon: float) -> float:
    return loop.plant_segments * Size([loop], horizon).steps


def tried_elsewhere(
    session: Session, study: Study, network: Inverse | None, gains: Mapping[str, Mapping[str, float]]
) -> dict[str, dict[str, dict[str, int]]]:
    """Try gains with the motions of the scenarios on the loops that none of these is on: marks by controller and loop.

    Plain Python is not tried on loops that it cannot keep up with.
    """
    settings = study.tune
    tried: dict[str, dict[str, dict[str, int]]] = {name: {} for name in gains}
    others = others_of(study)
    done, whole = 0.0, sum(others.values()) * len(gains)
    with session.progress("trying the gains on other loops", 100, "%", after=_MARGINS * len(gains)) as report:
        for loop, effort in others.items():
            scenarios = tuple(dict.fromkeys(one.model_copy(update={"loop": loop}) for one in settings.scenarios))
            elsewhere = study.model_copy(update={"tune": settings.model_copy(update={"scenarios": scenarios})})
            cases = tuning_cases(elsewhere, network)[0]
            for name, values in gains.items():
                law = controller(name)
                if law.keeps_up(settings.loops[loop].control_period):
                    tried[name][loop] = marks_of(law, np.array(law.values(values)), cases, study.wrist)
                done += effort
                report(round(100.0 * done / whole))
    return tried
