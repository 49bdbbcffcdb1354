"""The study of all laws: tuned and judged at equal budget on every family of worlds, and which is for which rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_family,
    check_family_reach,
    check_inverses,
    check_row,
    check_searched,
    family_of,
    inverses_of,
)
from wristctl.commands.loop_warnings import warn_of_one_plane
from wristctl.commands.procedure import Procedure
from wristctl.commands.session import Session
from wristctl.commands.step_times import after_rollouts
from wristctl.commands.study.units import (
    Studied,
    StudyPlace,
    budget_of,
    families_of,
    golden_of,
    judge_all,
    planes_of_family,
    search_units,
    ways_to_tune,
)
from wristctl.commands.units import performed
from wristctl.config.study import Study
from wristctl.errors import UserError, meant, under
from wristctl.work.worker import Unit

if TYPE_CHECKING:
    import numpy as np


def plan(study: Study, inputs: Inputs) -> str:
    """Check all names, and state the number of rollouts."""
    from wristctl.simulation.closed_loop import Size, check_size, check_steps
    from wristctl.tuning.search import check_optimiser

    settings = study.study
    with under("study"):
        budget = budget_of(settings)
        if not families_of(study):
            raise UserError("no families of worlds", "families", "include some of experiments/scenarios")
        for name in (*families_of(study), *filter(None, [settings.varied])):
            family_of(study.families, name, "families")
        check_searched(settings.laws)
        for number, row in enumerate(settings.presets):
            with under(f"presets.{number}"):
                check_row(row, None)
        labels = _labels(study)
        for term, pair in settings.terms.items():
            for label in pair:
                if label not in labels:
                    raise UserError(f"'{label}' is not in the study", f"terms.{term}", meant(label, labels))
        for name, _, way in ways_to_tune(study):
            overridden = name in settings.variants and settings.variants[name].optimiser
            places = {
                "tune.candidates": f"budgets.{settings.budget}.candidates",
                "tune.optimiser": f"variants.{name}.optimiser" if overridden else "optimiser",
            }
            try:
                check_optimiser(way)
            except UserError as error:
                raise error.at(places.get(str(error.where), "optimiser")) from error
        families = {name: study.families[name] for name in families_of(study)}
        for name, family in families.items():
            check_size(Size([family.loop], family.horizon), planes_of_family(study, name))
            check_inverses(inverses_of(family.references), inputs)
    for name in families:
        check_family_reach(study, name)
    searches, judged = sum(unit.size for unit in search_units(study).values()), _rollouts_of_tests(study)
    longest = max(Size([studied.loop], studied.horizon).steps for studied in families.values())
    with under("study"):
        check_steps((searches + judged) * longest, searches + judged)
    evaluations = budget.candidates * budget.iterations
    return (
        f"{len(settings.laws)} controllers, each tuned {budget.tunings} times with {evaluations} evaluations on "
        f"{budget.draws} worlds of {', '.join(families)}, tested with "
        f"{len(labels) - len(settings.laws)} presets on {budget.worlds} held-out worlds of each: "
        f"{searches} rollouts of searches and {judged} of tests"
    )


def _rollouts_of_tests(study: Study) -> int:
    """Rollouts in which tuned gains and presets are judged."""
    from wristctl.comparison.world_ranking import noises_of
    from wristctl.control.table import controller
    from wristctl.tuning.objective import YARDSTICK

    settings, budget = study.study, budget_of(study.study)
    families = [study.families[name] for name in families_of(study)]
    per_world = sum(len(family.references) * noises_of(family, budget.noises) for family in families)
    alone = {f"{YARDSTICK}/default": YARDSTICK} | {row.label: row.controller for row in settings.presets}
    rows = budget.tunings * sum(controller(name).learning for name in settings.laws)
    rows += sum(controller(name).learning for name in alone.values())
    return per_world * budget.worlds * rows


def _labels(study: Study) -> list[str]:
    """The rows of every ranking."""
    from wristctl.tuning.objective import YARDSTICK

    presets = [row.label for row in study.study.presets]
    return list(dict.fromkeys([*(f"{law}/tuned" for law in study.study.laws), *presets, f"{YARDSTICK}/default"]))


def fair_study(session: Session) -> Studied:
    """Tune and judge all laws at equal budget on families of worlds: which is for which rig, what each term buys."""
    from wristctl.commands.study.results import written
    from wristctl.tuning.search import search_of

    study = session.study
    for name in families_of(study):
        warn_of_one_plane(study.wrist, asked_of_family(study, name))
    with session.progress("compiling, and computing the golden rollouts"):
        golden = golden_of(study)
    session.findings.numerics(golden=golden.expected, executor=session.executor)
    wanted = search_units(study)
    after = after_rollouts(len(families_of(study)) * len(study.study.laws))
    then = _rollouts_of_tests(study) / sum(unit.size for unit in wanted.values())
    tuned = performed(session, "study", "tuning", list(wanted.values()), golden, then=then, after=after)
    searches = {
        place: search_of(arrays, place.law, 1)
        for place, arrays in zip(wanted, tuned.arrays, strict=True)
        if arrays is not None
    }
    pieces = judge_all(study, {place: search.gains for place, search in searches.items()})
    tests = [unit for units in pieces.values() for unit in units]
    judged = performed(session, "study", "judging", tests, golden, after=after)
    poisoned = [*tuned.poisoned, *judged.poisoned]
    return written(session, _whole(pieces, judged.arrays), searches, poisoned)


def _whole(
    wanted: Mapping[StudyPlace, Sequence[Unit]], arrays: Sequence[dict[str, np.ndarray] | None]
) -> dict[StudyPlace, list[dict[str, np.ndarray]]]:
    """Judgements of which every range of worlds was computed, by place."""
    complete, results = {}, iter(arrays)
    for place, units in wanted.items():
        pieces = [next(results) for _ in units]
        judged = [piece for piece in pieces if piece is not None]
        if len(judged) == len(pieces):
            complete[place] = judged
    return complete


FAIR_STUDY = Procedure(
    "study",
    plan,
    fair_study,
    (EarlierRun("resume", kind="study", optional=True, unfinished=True),),
    in_units=True,
    in_one_plane=lambda study: any(planes_of_family(study, name) == 1 for name in families_of(study)),
)
