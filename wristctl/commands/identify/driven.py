"""What open logs of tendons' tensions or motors' currents tell: parameters, or that these data do not tell them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.identify.answer import recommendation_by_ratios
from wristctl.commands.inputs_of_loops import RATIOS
from wristctl.commands.printed_table import COLUMNS, Table, degrees, joined, number
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.arc_fit import Told
    from wristctl.identification.driven_fit import DrivenFit
    from wristctl.records.open_log import OpenLog


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
        import pandas as pd

        rows = [
            (name, *((told.value, told.low, told.high) if told.known else [math.nan] * 3), told.unit, told.meaning)
            for name, told in self.told.items()
        ]
        return pd.DataFrame(rows, columns=["parameter", "value", "low", "high", "unit", "meaning"])


def driven_plan(study: Study, logs: Sequence[OpenLog]) -> str:
    """Say what is looked for in which logs."""
    from wristctl.identification.driven_log import driven_robot

    robot, recordings, remarks = driven_robot(logs, study.wrist, study.identify)
    names, samples = ", ".join(robot.unknowns(())), sum(map(len, logs))
    plan = f"{names}, then friction and creep, from {len(recordings)} trials of {robot.quantity}s, {samples} samples"
    return "\n".join([plan, *(remark for log in logs for remark in log.remarks), *remarks])


def identify_driven(session: Session, logs: Sequence[OpenLog]) -> DrivenTold:
    """Find what logs of tensions or currents tell, in their run."""
    from wristctl.commands.validate.answer import model_rows
    from wristctl.commands.validate.figures import errors_of_models, left_over, motion
    from wristctl.identification.driven_fit import fitted_logs
    from wristctl.identification.driven_forward import STEP
    from wristctl.identification.log_model import rate_of_logs
    from wristctl.identification.real_robots import RealRobot

    findings, study = session.findings, session.study
    with session.progress("fitting models") as report:
        found = fitted_logs(logs, study.wrist, study.identify, report)
    robot, score, scale = found.robot, found.chosen.score, found.robot.scale
    findings.numerics(integrator="RODAS3", step=STEP, segments=1, planes=2)
    findings.metric("error", scale * score.error, "deg", "lower", score.blocks, (scale * score.low, scale * score.high),
                    "RMS of the part that was predicted")  # fmt: skip
    findings.metric("error_share", found.share, "", "lower", score.blocks, None, "that over its motion")
    about = RealRobot("this robot", "", robot, lambda files: [], "", "predicted part")
    with session.drawing():
        findings.figure("motion", motion, about, found.chosen.fits, caption="measured motion and prediction")
        findings.figure("left-over", left_over, about, found.chosen.fits, caption="what is left of the motion")
        findings.figure("models", errors_of_models, about, found.models, caption="error of each model")
    findings.overview.figure = "motion"
    heads = ("model", "numbers", "predicted part [deg]", "over that without", "")
    models = Table("What each model misses", heads, model_rows(found.models, scale))
    remarks = [*(remark for log in logs for remark in log.remarks), *found.remarks]
    _refuse(session, found, remarks)
    for name, told in found.fit.told.items():
        ends = (told.low, told.high) if told.known else None
        findings.metric(name, told.value if told.known else None, told.unit, "", 1, ends, told.meaning)
    result = DrivenTold(study, findings, [models, _table(found.fit.told)], found, rate_of_logs(logs), remarks)
    findings.table("data/parameters.csv", result.frame())
    findings.plain(RATIOS, result.ratios)
    return result


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
    from wristctl.identification.driven_log import motion_for

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
        motions = dict.fromkeys(motion_for(name) for name in untold)
        notes.append(f"Not identifiable from these data: {joined(untold)}. What would tell: {'; '.join(motions)}.")
    notes += [wanted_terms(found.models), *remarks]
    if found.robot.drive == "current":
        notes.append(
            "Currents have no scale in newtons: this is stiffness over the motors' gain, and damping and inertia over "
            "stiffness. N m/rad needs identify.torque_constant and identify.spool_radius, or tension_1 [N], ..."
        )
    if run and known:
        notes += recommendation_by_ratios(run, found.robot.drive == "tension" and "stiffness" in known)
    more = "Errors of each model, figures: --all, or the run's report.html."
    return Answer(sentence, _table(told).within(COLUMNS), notes, more)


def _table(told: Mapping[str, Told]) -> Table:
    """Parameters with their 95 % intervals, angles in degrees."""
    rows = []
    for name, one in told.items():
        turned = math.degrees(1.0) if one.unit == "rad" else 1.0
        value, low, high = (number(turned * part) for part in (one.value, one.low, one.high))
        unit = "deg" if one.unit == "rad" else one.unit
        cells = (value, f"{low} to {high}") if one.known else ("not identifiable", "")
        rows.append((name, *cells, unit, one.meaning))
    return Table("", ("parameter", "value", "95 %", "unit", "meaning"), rows)
