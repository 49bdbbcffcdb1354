"""What open logs in two planes tell of the study's wrist: springs as an ellipse, and the place of each tendon."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer, rest
from wristctl.commands.identify.answer import comparison_on, recommendation_for, simulation_of
from wristctl.commands.identify.logs import logs_of
from wristctl.commands.printed_table import COLUMNS, Table, degrees, joined
from wristctl.commands.quantities import keep_told, told_frame, told_table
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import Setting, UserError
from wristctl.wrist.directions import toward_words

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.arc_fit import Told
    from wristctl.identification.fit import Fit
    from wristctl.identification.intervals import Knowledge
    from wristctl.identification.lack_of_fit import Misfit
    from wristctl.identification.measured_trials import MeasuredTrial
    from wristctl.identification.problem import Problem

# Draws of the posterior that a run keeps as a family of worlds.
DRAWS = 200
# Part of the larger motion up to which the motion in the other plane is none.
_ASIDE = 0.1
# What has to be told before a wrist is written down.
_NEEDED = ("stiffness", "stiffness_across", "damping", "tendon_stiffness")


@dataclass(frozen=True, repr=False, eq=False)
class BendsTold(StudyResult):
    """A wrist's springs in two planes, its tendons' places, damping and delay, with intervals or not identifiable."""

    kind = "identify"

    fit: Fit
    knowledge: Knowledge
    told: Mapping[str, Told]
    yaml: str
    """A study file with the wrist, actuator and sensor that were found; empty where too little is told."""
    scaled: bool = True
    """Whether anybody has said a force or a mass."""
    remark: str = ""
    """Which of two masses counts."""

    @property
    def answer(self) -> Answer:
        """Springs in the sentence, then each parameter with its interval or not identifiable."""
        return _answer(self)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter that is told, in the units of `frame`."""
        return {name: one.value for name, one in self.told.items() if one.known}

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value and ends of its interval, nan where the readings do not tell it, and unit."""
        return told_frame(self.told)


def _in_one_plane_too(study: Study) -> bool:
    """Whether commands in one plane take the study's wrist."""
    from wristctl.wrist.tendon_layout import off_both_sides

    return off_both_sides(study.wrist) is None


def _problem(study: Study) -> Problem:
    from wristctl.config.plant import Actuator
    from wristctl.identification.measured_trials import places_of_log, trials_of_logs
    from wristctl.identification.problem import bend_problem
    from wristctl.records.log_looks import telling

    settings = study.identify
    logs = [telling(log) for log in logs_of(study)]
    places = places_of_log(logs[0], study.wrist)
    trials = trials_of_logs(logs, study.wrist, settings.step, settings.exposure or 0.0)
    return bend_problem(trials, places, study.wrist, Actuator(level="tendon"), settings)


def bends_plan(study: Study) -> str:
    """Say what is looked for in which logs."""
    problem = _problem(study)
    readings = sum(len(trial.angle) for trial in problem.trials)
    masses = len({trial.wrist.hand_mass for trial in problem.trials})
    return f"{', '.join(problem.free)} from {len(problem.trials)} trials, {readings} readings, {masses} masses"


def identify_bends(session: Session) -> BendsTold:
    """Find what open logs in two planes tell of the study's wrist, in their run."""
    import numpy as np

    from wristctl.commands.identify.figures import angles, residuals
    from wristctl.commands.identify.tables import fit_table, residual_table
    from wristctl.identification.bend_estimates import (
        bends_yaml,
        forces_are_scaled,
        overruled_mass,
        told_of_bends,
        without_forces,
    )
    from wristctl.identification.fit import fit
    from wristctl.identification.intervals import knowledge
    from wristctl.identification.lack_of_fit import misfits

    findings, settings = session.findings, session.study.identify
    with session.progress("searching"):
        problem = _problem(session.study)
        fitted = fit(problem)
        known = knowledge(fitted)
    told, missed, scaled = (
        told_of_bends(fitted, known),
        misfits(fitted),
        forces_are_scaled(problem, session.study.wrist),
    )
    if not scaled:
        told = without_forces(told)
    findings.numerics(integrator="RODAS3", step=settings.step, segments=settings.segments, planes=2)
    keep_told(findings, told)
    tables = [told_table(told, "What the readings tell"), fit_table(findings, fitted, known), residual_table(missed)]
    with session.drawing():
        findings.figure("bends", angles, fitted, caption="measured bends, the model's, and the difference")
        findings.figure("residuals", residuals, fitted, known)
    mass = overruled_mass(problem, session.study.wrist)
    remark = "" if mass is None else (
        f"The mass that the logs say counts, {mass:g} kg, and not {session.study.wrist.hand_mass:g} kg of "
        "wrist.hand_mass: mend the column `mass`, or leave it out."
    )  # fmt: skip
    result = BendsTold(session.study, findings, tables, fitted, known, told, "", scaled, remark)
    _refuse(session, result, missed)
    if all(told[name].known for name in _NEEDED):
        rng = np.random.default_rng(findings.stream("posterior"))
        yaml, family = bends_yaml(fitted, known, session.study.wrist, DRAWS, rng)
        findings.text("data/identified.yaml", yaml)
        if _in_one_plane_too(session.study):
            findings.text("data/posterior.yaml", family)
        result = replace(result, yaml=yaml)
    findings.table("data/parameters.csv", result.frame())
    return result


def _refuse(session: Session, result: BendsTold, missed: Sequence[Misfit]) -> None:
    """UserError where the model does not fit the readings, with the answer told all the same."""
    settings, worst = session.study.identify, max(missed, key=lambda misfit: misfit.ratio)
    if settings.misfit == "tell" or worst.ratio <= settings.lack_of_fit:
        return
    session.tell_refused(result.answer)
    problem = f"{worst.direction}: the model is off by {math.sqrt(worst.ratio):.2g} times the readings' own noise"
    accept = ("check geometry, masses and senses; or take it as it is: ", Setting("misfit=tell", "identify"))
    raise UserError(problem, "identify", accept, exit_code=3)


def what_tells(fit: Fit, lacking: Sequence[str]) -> str:
    """What of it the logs have not, and would tell the parameters that are lacking; empty where nothing is known."""
    import numpy as np

    from wristctl.identification.measured_trials import PLANES

    trials = fit.problem.trials
    springs = any(name.startswith("stiffness") for name in lacking)
    forces = springs or any(name in ("damping", "tendon_stiffness") for name in lacking)
    parts = ["motions toward both ulnar and flexion"] * (springs and _in_one_plane(trials))
    if forces and len({trial.wrist.hand_mass for trial in trials}) == 1:
        parts.append("trials with another mass [kg]")
    if springs:
        parts.append("tendons that go slack")
    if (forces or any("friction" in name for name in lacking)) and not any(
        np.any(trial.channel >= len(PLANES)) for trial in trials
    ):
        parts.append("tensions")
    if any(name in ("delay", "damping") for name in lacking):
        parts.append("quicker moves")
    listed = joined(parts)
    return f"{listed[0].upper()}{listed[1:]} tell more (documentation: System identification)." if parts else ""


def _in_one_plane(trials: Sequence[MeasuredTrial]) -> bool:
    """Whether all trials bend in the plane of ulnar and radial, or all in that of flexion and extension."""
    import numpy as np

    ways = [
        max((float(np.ptp(seen)) for trial in trials if (seen := trial.angle[trial.of(plane)]).size), default=0.0)
        for plane in (0, 1)
    ]
    return min(ways) < _ASIDE * max(ways)


def _answer(result: BendsTold) -> Answer:
    fit, told, run = result.fit, result.told, result.place if result.yaml else ""
    along, across, axis = (told[name] for name in ("stiffness", "stiffness_across", "stiffness_axis_deg"))
    if along.known and across.known:
        where = toward_words(axis.value) if axis.known else "along an axis that is not identifiable"
        springs = f"The springs have {along.value:.3g} N m/rad {where}, and {across.value:.3g} across."
    else:
        springs = "The springs are not identifiable from these readings."
    readings = sum(map(len, fit.residuals))
    left = f"{degrees(float(fit.noise))} deg are left over of {readings} readings (standard deviation)."
    notes: list[str | Table] = [result.remark] * bool(result.remark)
    if lacking := [name for name, one in told.items() if not one.known]:
        notes.append(f"Not told: {joined(lacking)}. {what_tells(fit, lacking)}".strip())
    if not result.scaled:
        mass = fit.problem.trials[0].wrist.hand_mass
        notes.append(
            f"Forces need a mass or a tension, and nobody has said one: {mass:g} kg are the hand's by default. Weigh "
            "it and add `--set wrist.hand_mass=KG`, with `wrist.length` and `wrist.hand_offset` [m]; without "
            "`model=wrist` the same log tells ratios."
        )
    if run:
        square = _in_one_plane_too(result.study)
        compares = ", or compare controllers on all that the readings leave possible"
        notes += [
            f"Next, find its gains, bend it in simulation{compares * square}:",
            f"$ {recommendation_for(run, f'{run}/config.yaml')}",
            f"$ {simulation_of(run, f'{run}/config.yaml')} --reference circumduction",
            *[f"$ {comparison_on(run)}"] * square,
        ]
    return Answer(f"{springs} {left}", told_table(told).within(COLUMNS), notes, rest("Figures", result.place))
