"""The units of work of a study of all laws: its searches, then its judgements of the gains that they found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from wristctl.config.control import TuneSettings
from wristctl.config.fair_study import FairStudySettings, StudyBudget, StudyVariant
from wristctl.config.families import TuningWorlds
from wristctl.config.study import Study
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.work.fan_out import UnitsDone
    from wristctl.work.unit import Unit
    from wristctl.work.worker import Golden

BASE = ""
"""The study's own way to tune, among its variants."""


class StudyPlace(NamedTuple):
    """What a search or a judgement is of."""

    variant: str
    family: str
    label: str
    law: str


def budget_of(settings: FairStudySettings) -> StudyBudget:
    """The budget that is named. UserError with the nearest name where there is none."""
    from wristctl.config.errors import UserError, meant

    if settings.budget not in settings.budgets:
        raise UserError(f"unknown budget '{settings.budget}'", "budget", meant(settings.budget, settings.budgets))
    return settings.budgets[settings.budget]


def families_of(study: Study) -> tuple[str, ...]:
    """The names of the families that are studied."""
    return study.study.families or tuple(study.families)


def search_units(study: Study) -> dict[StudyPlace, Unit]:
    """A search for every law on every family, and for every variant on one."""
    from wristctl.tuning.search_unit import search_unit

    settings, found = study.study, dict[StudyPlace, "Unit"]()
    varied = settings.varied or families_of(study)[0]
    ways = [(BASE, family, StudyVariant()) for family in families_of(study)]
    ways += [(name, varied, variant) for name, variant in settings.variants.items()]
    for name, family, variant in ways:
        tuned = study.model_copy(update={"tune": _tune_settings(study, family, variant)})
        for law in settings.laws:
            found[StudyPlace(name, family, f"{law}/tuned", law)] = search_unit(tuned, law)
    return found


def judge_all(study: Study, gains: Mapping[StudyPlace, Mapping[str, float]]) -> dict[StudyPlace, list[Unit]]:
    """All gains that were found, and the presets, on the held-out worlds; a variant's with the first noise only."""
    from wristctl.comparison.judge_unit import judge_units
    from wristctl.control.table import controller, gains_of
    from wristctl.tuning.objective import YARDSTICK

    budget, found = budget_of(study.study), dict[StudyPlace, list["Unit"]]()
    chosen: dict[StudyPlace, Mapping[str, float]] = dict(gains)
    for family in families_of(study):
        for row in study.study.presets:
            law = controller(row.controller)
            chosen[StudyPlace(BASE, family, row.label, law.name)] = dict(
                zip(law.gains, gains_of(law, row.gains), strict=True)
            )
        chosen.setdefault(StudyPlace(BASE, family, f"{YARDSTICK}/default", YARDSTICK), {})
    for place, values in chosen.items():
        noises = budget.noises if place.variant == BASE else 1
        found[place] = judge_units(study, place.family, place.law, values, budget.worlds, noises)
    return found


def golden_of(study: Study) -> Golden:
    """The numbers that all workers must come to; all that the study runs is compiled by then."""
    from wristctl.simulation.golden import GOLDEN, golden_spec, kinds_of_worlds
    from wristctl.tuning.objective import YARDSTICK
    from wristctl.work.worker import Golden

    settings = study.study
    laws = dict.fromkeys([YARDSTICK, *settings.laws, *(each.controller for each in settings.presets)])
    loops = kinds_of_worlds(study.families, families_of(study), study.seed)
    return Golden.here(GOLDEN, golden_spec(laws, loops, study.wrist))


def performed(
    session: Session, what: str, units: Sequence[Unit], golden: Golden | None, command: str = "study"
) -> UnitsDone:
    """Compute units with the session's workers, into the run where there is one, and show how far they have come.

    The hashes of laws from elsewhere are part of the units' specifications.
    """
    from wristctl.studies.adopted import adoption, sources_in
    from wristctl.work.executors import Workers
    from wristctl.work.fan_out import perform_units
    from wristctl.work.unit import UNITS
    from wristctl.work.worker import Computed, Furnish

    run, stopped = session.findings.run, session.inputs.runs().get("resume")
    folder, earlier = (each.path / UNITS if each else None for each in (run, stopped))
    if folder is not None:
        folder.mkdir(exist_ok=True)
    furnish = None
    if sources := sources_in(session.study):
        units = [replace(each, spec={**each.spec, "sources": sources}) for each in units]
        furnish = Furnish("wristctl.studies.adopted:adopt", adoption(session.study, command))
    count, counted = 0, "rollouts" if golden else "points"
    with session.progress(what, total=sum(each.size for each in units), unit=counted) as done:

        def told(unit: Unit, computed: Computed | None) -> None:
            nonlocal count
            count += unit.size
            done(count)
            if computed is not None:
                spent = {"host": computed.host, "seconds": computed.seconds, "processor": computed.processor}
                session.findings.event("unit", name=unit.name, key=unit.key, rollouts=unit.size, **spent)

        found = perform_units(units, Workers.of(session.executor), golden, folder, earlier, told, furnish)
    for each in found.poisoned:
        session.findings.event("warning", message=f"{each.unit.name} was given up: {each.why}")
    return found


def _tune_settings(study: Study, family: str, variant: StudyVariant) -> TuneSettings:
    """Of a search on a family: the study's own, but for what the variant says."""
    settings, budget = study.study, budget_of(study.study)
    return TuneSettings(
        optimiser=variant.optimiser or settings.optimiser,
        objective=variant.objective or settings.objective,
        candidates=budget.candidates,
        iterations=max(1, round(variant.share * budget.iterations)),
        finalists=budget.finalists,
        worlds=TuningWorlds(family=family, draws=budget.draws, validation=budget.validation),
    )
