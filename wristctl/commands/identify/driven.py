"""What open logs of tendons' tensions or motors' currents tell: parameters, or that these data do not tell them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer, rest
from wristctl.commands.identify.answer import bound_of_delay, recommendation_by_ratios
from wristctl.commands.inputs import RATIOS
from wristctl.commands.printed_table import COLUMNS, Table, degrees, joined
from wristctl.commands.quantities import MEANT, keep_told, told_frame, told_table
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.arc_fit import Told
    from wristctl.identification.arc_robot import ArcRobot
    from wristctl.identification.driven_fit import DrivenFit
    from wristctl.identification.model_choice import TriedModel
    from wristctl.records.open_log import OpenLog

# Share of the time of all fits [%] that models take which a part is predicted by; seconds of the figures.
TRIED, DRAWN = 85, 1.0


@dataclass(frozen=True, repr=False, eq=False)
class DrivenTold(StudyResult):
    """What logs of tensions or currents tell: parameters with intervals, and which terms of the model the data want."""

    kind = "identify"

    found: DrivenFit
    rate: float
    """Readings of the motion per second."""
    remarks: Sequence[str] = ()
    """What reading and looking mended, and what was taken how."""

    @property
    def told(self) -> Mapping[str, Told]:
        """Each parameter, in SI units."""
        return self.found.fit.told

    @property
    def ratios(self) -> dict[str, Any]:
        """What it tells of a wrist: `identification.ratios`."""
        from wristctl.identification.ratios import ratios_of_driven

        return ratios_of_driven(self.found.fit, self.found.robot, self.rate)

    @property
    def answer(self) -> Answer:
        """Parameters with intervals, and the motions that would tell the others."""
        return driven_answer(self.found, self.remarks, self.place)

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value and ends of its interval, nan where the data do not tell it, and unit."""
        return told_frame(self.told)


def driven_plan(study: Study, logs: Sequence[OpenLog]) -> str:
    """Say what is looked for in which logs."""
    from wristctl.identification.driven_log import driven_robot

    robot, recordings, remarks = driven_robot(logs, study.wrist, study.identify)
    names, samples = ", ".join(robot.unknowns(())), sum(map(len, logs))
    plan = f"{names}, then friction and creep, from {len(recordings)} trials of {robot.quantity}s, {samples} samples"
    return "\n".join([plan, *(remark for log in logs for remark in log.remarks), *remarks])


def identify_driven(session: Session, logs: Sequence[OpenLog]) -> DrivenTold:
    """Find what logs of tensions or currents tell, in their run."""
    from wristctl.identification.driven_fit import fitted_logs
    from wristctl.identification.driven_forward import STEP
    from wristctl.identification.log_model import rate_of_logs

    findings, study = session.findings, session.study
    with session.progress("fitting models", 100, "%", after=DRAWN) as report:
        found = fitted_logs(logs, study.wrist, study.identify, lambda share: report(round(TRIED * share)))
        report(100)
    findings.numerics(integrator="RODAS3", step=STEP, segments=1, planes=2)
    models = keep_prediction(session, found.robot, found.models, found.chosen)
    findings.metric("error_share", found.share, "", "lower", found.chosen.score.blocks, None, "that over its motion")
    remarks = [*(remark for log in logs for remark in log.remarks), *found.remarks]
    _refuse(session, found, remarks)
    keep_told(findings, found.fit.told)
    tables = [models, told_table(found.fit.told, MEANT)]
    result = DrivenTold(study, findings, tables, found, rate_of_logs(logs), remarks)
    findings.table("data/parameters.csv", result.frame())
    findings.plain(RATIOS, result.ratios)
    return result


def keep_prediction(session: Session, robot: ArcRobot, models: Sequence[TriedModel], chosen: TriedModel) -> Table:
    """Keep how well the chosen model predicts the part that was not fitted, with its figures; a table of all models."""
    from wristctl.commands.validate.answer import model_heads, model_rows
    from wristctl.commands.validate.figures import errors_of_models, left_over, motion
    from wristctl.identification.real_robots import RealRobot

    findings, (error, low, high) = session.findings, (robot.scale * value for value in chosen.score[:3])
    meaning = "RMS of the part that was predicted"
    findings.metric("error", error, robot.unit, "lower", chosen.score.blocks, (low, high), meaning)
    about = RealRobot("this robot", "", robot, lambda files: [], "", "predicted part")
    with session.drawing():
        findings.figure(
            "motion", motion, about, chosen.fits, caption="measured motion and prediction, where it was not fitted"
        )
        findings.figure("left-over", left_over, about, chosen.fits, caption="what is left of the motion")
        findings.figure("models", errors_of_models, about, models, caption="error of each model")
    findings.overview.figure = "motion"
    heads = model_heads("error of the predicted part", robot.unit)
    return Table("What each model misses", heads, model_rows(models, robot.scale))


def _refuse(session: Session, found: DrivenFit, remarks: Sequence[str]) -> None:
    """UserError where the model does not predict what was left out to a tenth of its motion; no parameter is told."""
    from wristctl.identification.driven_fit import LEAST
    from wristctl.identification.driven_log import wanted_motion

    if found.share <= LEAST or session.study.identify.misfit == "tell":
        return
    for remark in remarks:
        session.operator.tell(remark)
    problem = (
        f"not identifiable from these data: the model misses {degrees(found.chosen.score.error)} deg of a motion of "
        f"{degrees(found.moved)} deg that it was to predict, more than a tenth"
    )
    session.findings.summary(f"{problem[0].upper()}{problem[1:]}.")
    raise UserError(problem, found.recordings[0].name, wanted_motion(), exit_code=3)


def driven_answer(found: DrivenFit, remarks: Sequence[str], run: str = "") -> Answer:
    """What is identified and how well the rest is predicted, each parameter, and what would tell the others."""
    from wristctl.commands.validate.answer import wanted_terms
    from wristctl.identification.driven_log import motions_for

    told = found.fit.told
    known = [name for name, one in told.items() if one.known]
    error, low, high = (degrees(value) for value in found.chosen.score[:3])
    sentence = (
        f"Identified: {joined(known) or 'none of the parameters'}. Of the part that was not fitted the model predicts "
        f"the bend to {error} deg RMS (95 % {low} to {high}), {100.0 * found.share:.2g} % of its motion."
    )
    notes: list[str | Table] = []
    still = [f"{what}_{k}" for k in found.robot.still for what in ("direction", "gain")]
    untold = [*(name for name in told if name not in known), *still]
    if untold:
        what = "; ".join(motions_for(untold))
        notes.append(f"Not identifiable from these data: {joined(untold)}. What would tell: {what}.")
    notes += [wanted_terms(found.models), *bound_of_delay(told), *remarks]
    if found.robot.drive == "current":
        notes.append(
            "Currents have no scale in newtons: this is stiffness over the motors' gain, and damping and inertia over "
            "stiffness. N m/rad needs identify.torque_constant and identify.spool_radius, or tension_1 [N], ..."
        )
    if run and known:
        notes += recommendation_by_ratios(run, found.robot.drive == "tension" and "stiffness" in known)
    return Answer(sentence, told_table(told).within(COLUMNS), notes, rest("Errors of each model, figures", run))
