"""The units of work of a study of all laws: its searches, then its judgements of the gains that they found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.inputs_of_loops import asked_of_family, why_two_planes
from wristctl.commands.results import StudyResult
from wristctl.config.fair_study import FairStudySettings, StudyBudget, StudyVariant
from wristctl.config.families import TuningWorlds
from wristctl.config.study import Study
from wristctl.config.tune import TuneSettings
from wristctl.errors import UserError, meant
from wristctl.work.fan_out import Poisoned
from wristctl.work.worker import Golden, Unit

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.comparison.tuned_ranking import OrderShift, TermValue, TunedRanking
    from wristctl.tuning.search import Search


# Name of the study's own way to tune, among its variants.
BASE = ""


class StudyPlace(NamedTuple):
    """Variant, family, row, law and tuning of a search or a judgement; gains that are not searched have one tuning."""

    variant: str
    family: str
    label: str
    law: str
    tuning: int = 0


def budget_of(settings: FairStudySettings) -> StudyBudget:
    """The budget that is named. UserError with the nearest name where there is none."""
    if settings.budget not in settings.budgets:
        raise UserError(f"unknown budget '{settings.budget}'", "budget", meant(settings.budget, settings.budgets))
    return settings.budgets[settings.budget]


def families_of(study: Study) -> tuple[str, ...]:
    """The names of the families that are studied."""
    return study.study.families or tuple(study.families)


def ways_to_tune(study: Study) -> list[tuple[str, str, TuneSettings]]:
    """Variant, family and settings of every search of a law: the study's own on each family, and variants on one."""
    varied = study.study.varied or families_of(study)[0]
    ways = [(BASE, family, StudyVariant()) for family in families_of(study)]
    ways += [(name, varied, variant) for name, variant in study.study.variants.items()]
    return [(name, family, _tune_settings(study, family, variant)) for name, family, variant in ways]


def search_units(study: Study) -> dict[StudyPlace, Unit]:
    """Searches for every law on every family, and for every variant on one, as many as the budget has tunings."""
    from wristctl.tuning.search import search_unit

    units = dict[StudyPlace, "Unit"]()
    for name, family, settings in ways_to_tune(study):
        tuned = study.model_copy(update={"tune": settings})
        for law in study.study.laws:
            for tuning in range(budget_of(study.study).tunings):
                units[StudyPlace(name, family, f"{law}/tuned", law, tuning)] = search_unit(tuned, law, tuning)
    return units


def judge_all(study: Study, gains: Mapping[StudyPlace, Mapping[str, float]]) -> dict[StudyPlace, list[Unit]]:
    """All gains that were found, and the presets, on the held-out worlds; a variant's with the first noise only."""
    from wristctl.comparison.world_ranking import judge_units
    from wristctl.control.table import controller, gains_of
    from wristctl.tuning.objective import YARDSTICK

    budget, units = budget_of(study.study), dict[StudyPlace, list["Unit"]]()
    chosen: dict[StudyPlace, Mapping[str, float]] = dict(gains)
    for family in families_of(study):
        for row in study.study.presets:
            law = controller(row.controller)
            chosen[StudyPlace(BASE, family, row.label, law.name)] = dict(
                zip(law.gains, gains_of(law, row.gains, loop=study.families[family].loop), strict=True)
            )
        chosen.setdefault(StudyPlace(BASE, family, f"{YARDSTICK}/default", YARDSTICK), {})
    for place, values in chosen.items():
        noises = budget.noises if place.variant == BASE else 1
        units[place] = judge_units(study, place.family, place.law, values, budget.worlds, noises)
    return units


def golden_of(study: Study) -> Golden:
    """The numbers that all workers must come to; all that the study runs is compiled by then."""
    from wristctl.simulation.golden import GOLDEN, golden_spec, kinds_of_worlds
    from wristctl.tuning.objective import YARDSTICK

    settings = study.study
    laws = dict.fromkeys([YARDSTICK, *settings.laws, *(row.controller for row in settings.presets)])
    loops = kinds_of_worlds(study.families, families_of(study), study.seed)
    planes = [planes_of_family(study, family) for family in families_of(study)]
    return Golden.here(GOLDEN, golden_spec(laws, loops, study.wrist, planes))


def planes_of_family(study: Study, family: str) -> int:
    """Planes that all worlds of a family bend in. Raises UserError."""
    from wristctl.simulation.planes import planes_of

    return planes_of(study.wrist, asked_of_family(study, family))


def places_in(study: Study, family: str) -> int:
    """Places of tendons that a family's loops pull: both sides in one plane, in two all of the wrist."""
    from wristctl.wrist.tendon_layout import TendonLayout

    return 2 if planes_of_family(study, family) == 1 else len(TendonLayout.of(study.wrist).places)


def _tune_settings(study: Study, family: str, variant: StudyVariant) -> TuneSettings:
    """Settings of a search on a family: the study's, changed by the variant."""
    settings, budget = study.study, budget_of(study.study)
    return TuneSettings(
        optimiser=variant.optimiser or settings.optimiser,
        objective=variant.objective or settings.objective,
        candidates=budget.candidates,
        iterations=max(1, round(variant.share * budget.iterations)),
        finalists=budget.finalists,
        worlds=TuningWorlds(family=family, draws=budget.draws, validation=budget.validation),
    )


@dataclass(frozen=True, repr=False, eq=False)
class Studied(StudyResult):
    """All laws on all families."""

    kind = "study"

    rankings: dict[str, TunedRanking]
    """Rankings by family."""
    searches: dict[StudyPlace, Search]
    terms: list[TermValue]
    shifts: list[OrderShift]
    poisoned: list[Poisoned]
    """Units that failed on every worker: their rows are left out."""

    @property
    def answer(self) -> Answer | None:
        """Controller for each rig, gain of each term, and reliability of the order."""
        from wristctl.commands.study.answer import answer_of

        of_families = {name: asked_of_family(self.study, name) for name in families_of(self.study)}
        bending = [why_two_planes(self.study.wrist, asked, f" of {name}") for name, asked in of_families.items()]
        whole = " ".join(filter(None, bending))
        return answer_of(list(self.rankings.values()), self.terms, self.shifts, self.place, whole)

    @property
    def fault(self) -> UserError | None:
        """Error that names the units given up; None where all were computed."""
        if not self.poisoned:
            return None
        first = self.poisoned[0]
        more = f" and {len(self.poisoned) - 1} more" if len(self.poisoned) > 1 else ""
        reason = f"{first.unit.name}{more} failed wherever tried, and is left out: {first.why}"
        return UserError(reason, self.place, "mend it and resume: what is done is kept", exit_code=3)

    def frame(self) -> pd.DataFrame:
        """A row per family and row of its ranking, best first; angles in rad."""
        import pandas as pd

        from wristctl.comparison.world_ranking import ranking_frame

        tables = {name: ranking_frame(ranking) for name, ranking in self.rankings.items()}
        return pd.concat(tables, names=["family"]).reset_index("family").reset_index(drop=True)
