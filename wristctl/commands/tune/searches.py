"""The searches of a study's tune section, which `tune` and `compare` run: noted, resumed, and kept as they go."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.progress import duration
from wristctl.commands.results import Findings
from wristctl.commands.session import Done, Session
from wristctl.config.study import Study

if TYPE_CHECKING:
    from wristctl.control.law import Controller
    from wristctl.tuning.objective import Judge
    from wristctl.tuning.search import Search, Tried
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

# Seconds of a search from which it is said how long it takes.
_WORTH_SAYING = 5.0


def search_all(session: Session, study: Study, network: Inverse | None) -> dict[str, Search]:
    """Tune every controller of the study's tune section; what was found is kept also where it is cut short."""
    from wristctl.control.table import controller
    from wristctl.tuning.search import judges_of, search

    settings = study.tune
    _note_streams(session, study)
    judge, choose = judges_of(study, network)
    laws = {name: controller(name) for name in settings.controllers}
    fresh = [law for name, law in laws.items() if _known(session, name) is None]
    if fresh and (seconds := _seconds((judge, choose), fresh, study)) > _WORTH_SAYING:
        log.info("searching gains of %s: about %s", ", ".join(law.name for law in fresh), duration(seconds))
    searches: dict[str, Search] = {}
    try:
        for name in settings.controllers:
            total = settings.iterations * settings.restarts
            with session.progress(f"tuning {name}", total=total, unit="iterations") as advance:

                def so_far(result: Search, name: str = name, report: Done = advance) -> None:
                    searches[name] = result
                    report(len(result.tried.values), best=result.objective)

                tried = _known(session, name)
                searches[name] = search(study, laws[name], session.findings.stream, (judge, choose), so_far, tried)
    finally:
        _keep(session.findings, searches, choose or judge)
    return searches


# Promising candidates of an iteration, which run again at short steps and with changes of the loop, and the time of a
# rollout of the final choice over that of a rollout of the search: as measured on scenarios of one and two loops.
_PROMISING, _CHOICE = 2, 2.0


def _seconds(judges: tuple[Judge, Judge | None], laws: Sequence[Controller], study: Study) -> float:
    """About how long the searches of controllers take [s], by the time of one batch of candidates of the first."""
    import numpy as np

    (judge, choose), first, settings = judges, laws[0], study.tune
    middle = [math.sqrt(gain.low * gain.high) for gain in first.gains.values()]
    values = first.values(list(first.presets.values())[-1]) if first.presets else middle
    candidates = np.tile(np.array(values), (settings.candidates, 1))

    def timed(call: Callable[[], object]) -> float:
        call()  # compiles
        began = time.monotonic()
        call()
        return (time.monotonic() - began) / first.learning

    batch = timed(lambda: judge.beside(first, candidates, -math.inf))
    iteration = batch + _PROMISING * timed(lambda: judge(first, candidates[:1]))
    chosen = settings.finalists * (choose or judge).count / (settings.candidates * judge.count)
    search = settings.iterations * settings.restarts * iteration + _CHOICE * chosen * batch
    return search * sum(law.learning for law in laws)


def _note_streams(session: Session, study: Study) -> None:
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.drawn_worlds import streams_of
    from wristctl.simulation.worlds import Draws

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
    from wristctl.control.table import controller
    from wristctl.tuning.search import tried_of

    stopped = session.inputs.runs().get("resume")
    if stopped is None or not stopped.has(f"data/history-{name}.csv"):
        return None
    return tried_of(stopped.data(f"history-{name}"), list(controller(name).gains))


def _keep(findings: Findings, searches: dict[str, Search], judge: Judge) -> None:
    """Keep what was found, also of a search that was cut short."""
    from wristctl.commands.tune.figures import convergence, gain_history, tornado
    from wristctl.control.table import controller, write_gains
    from wristctl.tuning.search import finalists, history

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
