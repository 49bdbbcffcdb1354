"""What open logs tell of the robot that they are of: each parameter with its interval, or that they do not tell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.commands.answer import Answer, rest
from wristctl.commands.identify.answer import bound_of_delay, recommendation_by_ratios
from wristctl.commands.identify.driven import DRAWN, TRIED, DrivenTold, driven_plan, identify_driven, keep_prediction
from wristctl.commands.inputs import RATIOS
from wristctl.commands.printed_table import COLUMNS, Table, joined
from wristctl.commands.quantities import MEANT, keep_told, told_frame, told_table
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import Setting, UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.config.wrist import WristParameters
    from wristctl.identification.arc_fit import ArcFit
    from wristctl.identification.arc_robot import ArcRecording, ArcRobot
    from wristctl.identification.model_choice import TriedModel
    from wristctl.records.open_log import OpenLog

# Share of the motion's mean square that a prediction may miss before a log is refused, and share of the motion, without
# noise, that it may miss before no parameter is told.
_MISSED, _MISSED_OF_ALL = 0.5, 0.1


@dataclass(frozen=True, repr=False, eq=False)
class LogTold(StudyResult):
    """What open logs tell: parameters with intervals, and which terms of the model the data want."""

    kind = "identify"

    fit: ArcFit
    """The chosen model, fitted to all trials."""
    models: list[TriedModel]
    chosen: TriedModel
    remarks: Sequence[str] = ()
    """Which tendons were taken to pull to which side, where the motion says it, and what was mended."""
    rate: float | None = None
    """Readings of the motion per second; None without times."""
    samples: int = 0
    """Of the motion in the logs."""

    @property
    def ratios(self) -> dict[str, Any]:
        """What it tells of a wrist whose stiffness is given: `identification.ratios`."""
        from wristctl.identification.ratios import ratios_of

        return ratios_of(self.fit, self.rate)

    @property
    def answer(self) -> Answer:
        """Parameters with intervals or not identifiable, the terms that the data want, and what would tell more."""
        run = self.place if self.fit.predicts else ""
        remarks = [*self.remarks, settings_told(self.study.wrist)]
        return told_answer(self.fit, self.models, self.chosen, remarks, self.samples, run)

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value and ends of its interval, nan where the data do not tell it, and unit."""
        return told_frame(self.fit.told)


class ReadLogs(NamedTuple):
    """The robot of open logs, its recordings, and the number of samples of the motion that the logs have."""

    robot: ArcRobot
    recordings: list[ArcRecording]
    samples: int
    remarks: list[str]
    """Which tendons pull to which side, where the motion says it, and what reading and looking mended."""
    rate: float | None
    """Readings of the motion per second; None without times."""


def logs_of(study: Study) -> list[OpenLog]:
    """The study's logs, read and looked at; those of motors and motion in files of their own are joined."""
    from wristctl.records.joined_logs import check_whole, joined_logs
    from wristctl.records.log_converters import read_log
    from wristctl.records.log_looks import looked_at
    from wristctl.wrist.tendon_layout import TendonLayout

    settings = study.identify
    offset, names = TendonLayout.of(study.wrist).offset, (settings.columns or "").split(";")
    if len(names) not in (1, len(settings.logs)):
        problem = f"names for {len(names)} logs, and there are {len(settings.logs)}"
        raise UserError(problem, "identify.columns", "names for all of them, or with ; between those of each log")
    names *= len(settings.logs) // len(names)
    read = [
        looked_at(read_log(Path(file), own.strip(), "log", tendon_offset=offset), tendon_offset=offset)
        for file, own in zip(settings.logs, names, strict=True)
    ]
    for log in read:
        if not len(log):
            fix = "the file of a whole recording: was this one cut short, or its program stopped at once?"
            raise UserError("a header, and no samples below it", log.header or str(log.file), fix)
    joined = joined_logs(read)
    check_whole(joined)
    return [looked_at(log, tendon_offset=offset) if log.two_clocks else log for log in joined]


def _are_driven(logs: Sequence[OpenLog], study: Study) -> bool:
    """Whether tensions or currents move the wrist of the logs, as they have no spools."""
    from wristctl.identification.driven_log import drive_of_log

    return drive_of_log(logs[0], study.identify) is not None


def read_logs(logs: Sequence[OpenLog], study: Study) -> ReadLogs:
    """What a study's logs hold. Raises UserError for logs that no fit may be asked of."""
    from wristctl.identification.log_model import (
        rate_of_logs,
        readings_of_log,
        recordings_of_logs,
        robot_of_logs,
        spools_of_log,
    )
    from wristctl.identification.log_senses import check_places

    settings = study.identify
    robot = robot_of_logs(logs, study.wrist, settings.radius_error, settings.widest)
    turned = check_places(logs, robot, spools_of_log(logs[0]))
    sides = _sides(robot, spools_of_log(logs[0])) if len(robot.angles) > 2 and "turn" not in robot.base else ""
    recordings = recordings_of_logs(logs, robot)
    remarks = [*(remark for log in logs for remark in log.remarks), *turned, *[sides] * bool(sides)]
    rate = rate_of_logs(logs) if robot.timed else None
    return ReadLogs(robot, recordings, sum(map(readings_of_log, logs)), remarks, rate)


def _sides(robot: ArcRobot, numbers: Sequence[int]) -> str:
    first = robot.angles[0]
    sides = [[str(k) for k, angle in zip(numbers, robot.angles, strict=True) if (angle == first) == one]
             for one in (True, False)]  # fmt: skip
    return f"Tendons {joined(sides[0])} pull to one side and {joined(sides[1])} to the other, as the motion says."


def log_plan(study: Study) -> str:
    """Say what is looked for in which logs."""
    logs = logs_of(study)
    if _are_driven(logs, study):
        return driven_plan(study, logs)
    robot, recordings, samples, remarks, _ = read_logs(logs, study)
    names = ", ".join(robot.unknowns(()))
    plan = f"{names}, then slack, friction and creep, from {len(recordings)} trials of open logs, {samples} samples"
    return "\n".join([plan, *remarks])


def identify_logs(session: Session) -> LogTold | DrivenTold:
    """Find what open logs tell, in their run."""
    logs = logs_of(session.study)
    if _are_driven(logs, session.study):
        return identify_driven(session, logs)
    return _identify_spooled(session, logs)


def _identify_spooled(session: Session, logs: Sequence[OpenLog]) -> LogTold:
    from wristctl.identification.log_model import everything_fitted
    from wristctl.identification.model_choice import chosen_of, tried_models, whole_fit

    findings, study = session.findings, session.study
    robot, recordings, samples, remarks, rate = read_logs(logs, study)
    with session.progress("fitting models", 100, "%", after=DRAWN) as report:
        models = list(tried_models(robot, [recordings], False, told=lambda share: report(round(TRIED * share))))
        chosen = chosen_of(models)
        fit = whole_fit(models, everything_fitted(recordings))
        report(100)
    missed = chosen.fits[0].missed()
    if missed > _MISSED_OF_ALL and study.identify.misfit != "tell":
        fit = replace(fit, predicts=False)
        remarks = [*remarks, _unpredicted(missed)]
    keep_told(findings, fit.told)
    tables = [keep_prediction(session, robot, models, chosen), told_table(fit.told, MEANT)]
    result = LogTold(study, findings, tables, fit, models, chosen, remarks, rate, samples)
    findings.table("data/parameters.csv", result.frame())
    findings.plain(RATIOS, result.ratios)
    _refuse(session, result, recordings)
    return result


def _unpredicted(missed: float) -> str:
    return (
        f"Nothing is identifiable: the model misses {100.0 * missed:.0f} % of the motion that was not fitted, beside "
        f"noise, and a parameter is told where it misses at most {100.0 * _MISSED_OF_ALL:.0f} %. Are senses, order and "
        "units of spools and bend as they should be, and are all of one clock?"
    )


def _refuse(session: Session, result: LogTold, recordings: Sequence[ArcRecording]) -> None:
    """UserError where the model does not predict the motion, with the answer told all the same."""
    import numpy as np

    asked = np.concatenate([recording.measured[recording.asked] for recording in recordings])
    moved = float(np.sqrt(np.nanvar(asked, axis=0).sum()))
    score = result.chosen.score
    if score.error**2 <= _MISSED * moved**2 or session.study.identify.misfit == "tell":
        return
    unit, scale = result.fit.robot.unit, result.fit.robot.scale
    session.tell_refused(result.answer)
    problem = (
        f"the model misses {scale * score.error:.3g} {unit} of a motion of {scale * moved:.3g} {unit} that it was to "
        "predict: nothing of it is to be relied on"
    )
    accept = (
        "check senses of spools and bend, and wrist.tendon_radius; or take it as it is: ",
        Setting("misfit=tell", "identify"),
    )
    raise UserError(problem, recordings[0].name, accept, exit_code=3)


def settings_told(wrist: WristParameters) -> str:
    """Which lengths a fit of open logs takes from the study, since these logs do not tell them."""
    values = {"length": wrist.length, "tendon_radius": wrist.tendon_radius}
    words = [
        f"wrist.{name} = {value:.4g} m ({'given' if name in wrist.model_fields_set else 'by default'})"
        for name, value in values.items()
    ]
    return f"Not found but taken from settings: {joined(words)}."


def told_answer(
    fit: ArcFit, models: Sequence[TriedModel], chosen: TriedModel, remarks: Sequence[str] = (), samples: int = 0,
    run: str = "",
) -> Answer:  # fmt: skip
    """Parameters with intervals or not identifiable, the terms that the data want, what would tell more, what is next.

    Parameters
    ----------
    remarks : what reading and looking found
    samples : of the motion in the logs
    run : path of the run on whose wrist one may go on; empty where there is none
    """
    from wristctl.commands.validate.answer import wanted_terms
    from wristctl.identification.driven_log import motions_for

    unit, scale = fit.robot.unit, fit.robot.scale
    error, low, high = (f"{scale * value:.3g}" for value in chosen.score[:3])
    told = [name for name, one in fit.told.items() if one.known and one.low > 0.0]
    sentence = (
        f"Identified: {joined(told) or 'none of the parameters'}. Of the part that was not fitted the model "
        f"predicts the {fit.robot.measured} to {error} {unit} RMS (95 % {low} to {high})."
    )
    used = sum(len(recording.time) for recording in fit.recordings)
    fewer = f" Of {samples} samples the models are fitted at {used} instants, evenly over each trial."
    first = wanted_terms(models) + fewer * (used < samples)
    notes: list[str | Table] = [first, *bound_of_delay(fit.told), *remarks]
    untold = [name for name, one in fit.told.items() if not one.known]
    if what := "; ".join(motions_for(untold)):
        steps = " Quick steps: `wristctl hw-run identify --rig my_rig.py:RIG`." * ("quick steps" in what)
        notes.append(f"To tell {joined(untold)}, record: {what}.{steps}")
    if "force" not in fit.values:
        more = (
            "" if "softening" in fit.values else "; trials with several masses tell how much a load softens the wrist"
        )
        notes.append(f"Stiffness in N m/rad is not identifiable: it needs tension_1 [N], ... of all tendons{more}.")
    if run and any(one.known for one in fit.told.values()):
        notes += recommendation_by_ratios(run, "force" in fit.told and fit.told["force"].known)
    return Answer(sentence, told_table(fit.told).within(COLUMNS), notes, rest("Errors of each model, figures", run))
