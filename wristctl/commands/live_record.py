"""Live references of commands: checked before a run, listened to in it, and recorded."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.inputs_of_loops import planes_of_simulation
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.config.loop import LIVE, Reference, sample_period
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.directions import DIRECTIONS

if TYPE_CHECKING:
    from wristctl.trial.live_datagrams import LiveReference


def check_live(reference: Reference, controllers: Iterable[str], wrist: WristParameters, period: float) -> None:
    """UserError for limits of a live reference that are none, and for laws that look ahead of one, or of its record."""
    from wristctl.control.table import controller
    from wristctl.simulation.live_reference import LiveLimits, check_law

    if reference.kind == LIVE:
        LiveLimits.of(reference, wrist, period)
        for name in controllers:
            check_law(reference, name, controller(name).preview)


def tell_address(session: Session, live: LiveReference) -> None:
    """Say where wanted bends are listened for, and who may send them."""
    warning = "" if live.source.guarded else "; EVERY computer that reaches this one can move the wrist"
    session.operator.tell(f"listening for wanted bends at {live.source.words}{warning}")


def keep_live(findings: Findings, live: LiveReference) -> None:
    """Record what was followed, with how many datagrams were followed and refused."""
    from wristctl.trial.live_datagrams import REFUSALS
    from wristctl.trial.trial_results import RECORD

    findings.metric("datagrams_followed", live.bends.counts["followed"], meaning="wanted bends that were followed")
    for kind, meaning in REFUSALS.items():
        name = f"datagrams_refused_{kind.replace(' ', '_')}"
        findings.metric(name, live.bends.counts[kind], better="lower", meaning=meaning)
    if live.filled > 1:
        findings.table(RECORD, *live.record())
    findings.summary(live.said())


def listened(session: Session) -> Study:
    """The study of `simulate` with the record of its live reference, once that has come; another study as it is.

    The wall clock paces what is listened for. Raises UserError without a run directory, and where nobody can be heard.
    """
    study, run = session.study, session.findings.run
    chosen = study.simulate
    if not chosen.reference.is_live:
        return study
    from wristctl.simulation.live_reference import recorded
    from wristctl.trial.live_datagrams import LiveReference
    from wristctl.trial.trial_results import RECORD

    if run is None:
        problem = "a live reference is recorded in a run directory, and there is none"
        raise UserError(problem, "reference.kind", "a folder for it: out")
    plane, period = DIRECTIONS[chosen.direction].plane, sample_period(chosen.loop.control_period)
    planes = planes_of_simulation(study)
    live = LiveReference(chosen.reference, study.wrist, planes, plane, chosen.horizon, period, paced=True)
    try:
        tell_address(session, live)
        with session.progress(f"following the live reference for {chosen.horizon:g} s"):
            live.listen()
    finally:
        live.close()
    keep_live(session.findings, live)
    session.operator.tell(live.said())
    known = recorded(chosen.reference, run.path / RECORD)
    return study.model_copy(update={"simulate": chosen.model_copy(update={"reference": known})})


def with_record(session: Session) -> Session:
    """The session of trials whose live reference is over, with its record in place; another session as it is."""
    settings, run = session.study.hw_run, session.findings.run
    if run is None or not settings.reference.is_live:
        return session
    from wristctl.simulation.live_reference import recorded
    from wristctl.trial.trial_results import RECORD

    changed = settings.model_copy(update={"reference": recorded(settings.reference, run.path / RECORD)})
    return replace(session, study=session.study.model_copy(update={"hw_run": changed}))
