"""The model held against recordings of a real robot that its authors published."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.quantities import Quantity, documented, keep_told
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.config.choices import ROBOTS
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records.data_sets import DATA_SETS

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.arc_fit import ArcFit
    from wristctl.identification.model_choice import TriedModel
    from wristctl.identification.prediction_scores import Score
    from wristctl.identification.real_robots import RealRobot


@dataclass(frozen=True, repr=False, eq=False)
class Validated(StudyResult):
    """A real robot's model: what it predicts, what its recordings want, and what they tell."""

    kind = "validate"

    robot: RealRobot
    models: list[TriedModel]
    chosen: TriedModel
    steps: list[ArcFit]
    """Further recordings, predicted with what the chosen model found."""
    beside: Mapping[str, Score] = field(default_factory=dict)
    """Errors of predictions without a model, by their names."""

    @property
    def answer(self) -> Answer:
        """The authors' own error, then ours, what the data want and what they tell."""
        from wristctl.commands.validate.answer import validated_answer

        return validated_answer(self.robot, self.models, self.chosen, self.place, self.beside)

    def frame(self) -> pd.DataFrame:
        """One row per model: its terms, free numbers, error of the predicted part with its interval, its ratio."""
        import pandas as pd

        rows = []
        for model in self.models:
            score, ratio = model.score, model.ratio
            ends = (ratio.error, ratio.low, ratio.high) if ratio else (None, None, None)
            fitted = max(fit.rms() for fit in model.fits)
            rows.append((model.words, model.numbers, fitted, *score[:3], score.blocks, *ends, model.verdict))
        return pd.DataFrame(rows, columns=[quantity.name for quantity in _MODELS])


_SI = "rad or m"
_MODELS = (
    Quantity("model", "", "what it has"),
    Quantity("numbers", "", "free numbers of what is fitted"),
    Quantity("fitted", _SI, "RMS error of what was fitted, the largest of the cases"),
    Quantity("error", _SI, "RMS error of what was predicted"),
    Quantity("low", _SI, "of its 95 % interval"),
    Quantity("high", _SI, "of its 95 % interval"),
    Quantity("blocks", "", "blocks that were drawn for it"),
    Quantity("ratio", "", "error over that of the model without the last term, paired by blocks"),
    Quantity("ratio_low", "", "of its 95 % interval"),
    Quantity("ratio_high", "", "of its 95 % interval"),
    Quantity("verdict", "", "whether the data want the last term"),
)


def listed() -> Table:
    """Each data set, where it is, its licence, how many of its files have a hash here, and what reads it."""
    rows = [
        (name, one.place, one.licence, one.columns, len(one.hashes), "validate" if name in ROBOTS else "identify")
        for name, one in DATA_SETS.items()
    ]
    return Table("", ("robot", "where", "licence", "--columns", "hashes", "read by"), rows)


def with_recordings(study: Study) -> Study:
    """The study with the files of its folder named; the folder itself is no part of it any more.

    Raises UserError where no robot or folder is named, or a file is not as published.
    """
    settings = study.real_robot
    if settings.robot is None:
        raise UserError("a robot is needed", "validate", f"wristctl validate {next(iter(ROBOTS))}, or --list")
    if settings.data is None:
        return study
    found = DATA_SETS[settings.robot].found(Path(settings.data))
    changed = {"files": tuple(str(file) for file in found.values()), "data": None}
    return study.model_copy(update={"real_robot": settings.model_copy(update=changed)})


def _recordings(study: Study) -> tuple[RealRobot, dict[str, Path]]:
    settings = study.real_robot
    if settings.robot is None or not settings.files:
        raise UserError("its recordings are needed", "validate", "--data FOLDER; wristctl validate --list")
    robot: RealRobot = ROBOTS[settings.robot]
    return robot, DATA_SETS[settings.robot].by_content([Path(file) for file in settings.files])


def plan(study: Study, inputs: Inputs) -> str:
    """Check the files, and say what will be fitted and predicted."""
    from wristctl.identification.real_robots import recordings_of

    robot, files = _recordings(study)
    cases = recordings_of(robot, files)
    parts = [recording for case in cases for recording in case]
    fitted, asked = (sum(int(getattr(part, name).sum()) for part in parts) for name in ("fitted", "asked"))
    published = DATA_SETS[str(study.real_robot.robot)]
    checked = "as published (SHA-256)" if published.hashes else "not checked: no hashes of them are known"
    return (
        f"{robot.title}: {len(files)} files {checked}, licence {published.licence}\n"
        f"{robot.parts}: {fitted} samples fitted, {asked} predicted"
    )


def validate(session: Session) -> Validated:
    """Fit the model to a part of a real robot's recordings, and predict the rest.

    The error of the prediction stands beside that of the authors' own model. Which of slack, friction of tendons,
    friction inside the robot and creep the recordings want is found by the same prediction. Nobody's recordings are
    part of this package: --list says where each set is; its files are checked by their SHA-256, and the run keeps
    copies.
    """
    from wristctl.commands.validate import figures
    from wristctl.commands.validate.answer import models_table, parameters_table, steps_table
    from wristctl.identification.baselines import baselines
    from wristctl.identification.model_choice import chosen_of, tried_models
    from wristctl.identification.prediction_scores import score_of
    from wristctl.identification.real_robots import recordings_of

    findings, study = session.findings, session.study
    robot, files = _recordings(study)
    cases = recordings_of(robot, files)
    with session.progress("fitting models", 100, "%") as report:
        tried = robot.robot, cases, robot.centred, study.real_robot.terms
        models = list(tried_models(*tried, told=lambda share: report(round(100 * share))))
    chosen = chosen_of(models)
    steps = [chosen.fits[0].asked_of(recording) for recording in robot.steps(files)] if robot.steps else []
    _write(findings, robot, models, chosen, steps)
    fair = {} if robot.in_sample else baselines(cases, robot.centred)
    beside = {name: score_of(predicted) for name, predicted in fair.items()}
    for name, score in beside.items():
        ends = (robot.scale * score.low, robot.scale * score.high)
        key = name.lower().replace(" ", "_")
        findings.metric(key, robot.scale * score.error, robot.unit, "lower", score.blocks, ends, f"RMS, {robot.asked}")
    tables = [models_table(robot, models, beside), parameters_table(chosen.fits)]
    if steps:
        tables.append(steps_table(robot, steps))
    result = Validated(study, findings, tables, robot, models, chosen, steps, beside)
    findings.table("data/models.csv", result.frame(), *documented(_MODELS))
    with session.drawing():
        findings.figure("motion", figures.motion, robot, chosen.fits, caption="measured motion and prediction")
        findings.figure("left-over", figures.left_over, robot, chosen.fits, caption="what is left of the motion")
        findings.figure("models", figures.errors_of_models, robot, models, caption="error of each model")
    findings.overview.figure = "motion"
    findings.headline("error", "authors", "ratio_to_authors")
    return result


def _write(
    findings: Findings, robot: RealRobot, models: Sequence[TriedModel], chosen: TriedModel, steps: Sequence[ArcFit]
) -> None:
    import numpy as np

    scale, unit, score = robot.scale, robot.unit, chosen.score
    interval = (scale * score.low, scale * score.high)
    findings.metric("error", scale * score.error, unit, "lower", score.blocks, interval, f"RMS, {robot.asked}")
    if robot.authors:
        name, error = robot.authors[0]
        findings.metric("authors", error, unit, "lower", meaning=f"{name}, {robot.asked}")
        ends = (interval[0] / error, interval[1] / error)
        findings.metric(
            "ratio_to_authors", scale * score.error / error, "", "lower", score.blocks, ends, "our error over theirs"
        )
    for model in models:
        if model.ratio is not None:
            term = "_".join(model.terms[-1].split())
            name = f"ratio_{term}" if len(model.terms) <= 2 else "ratio_all_wanted"
            ends = (model.ratio.low, model.ratio.high)
            meaning = f"error over that without {model.terms[-1]}: {model.verdict}"
            findings.metric(name, model.ratio.error, "", "lower", model.ratio.blocks, ends, meaning)
    for number, fit in enumerate(chosen.fits):
        of_case = f"_{number + 1}" if len(chosen.fits) > 1 else ""
        keep_told(findings, fit.told, of_case)
    for step in steps:
        name = step.recordings[0].name.replace(", ", "_").replace(" ", "")
        findings.metric(name, scale * step.rms("asked"), unit, "lower", meaning="RMS error of a step in a closed loop")
    columns: dict[str, list[np.ndarray]] = {}
    for fit in (*chosen.fits, *steps):
        for recording, wrong in zip(fit.recordings, fit.errors, strict=True):
            axes = ("bend_y", "bend_z") if recording.measured.shape[1] == 2 else ("tip_x", "tip_y", "tip_z")
            part = np.where(recording.fitted, "fitted", np.where(recording.asked, "predicted", "zero"))
            row = {"recording": np.full(len(wrong), recording.name), "part": part, "time": recording.time}
            row |= {axis: recording.measured[:, k] for k, axis in enumerate(axes)}
            row |= {f"{axis}_model": recording.measured[:, k] + wrong[:, k] for k, axis in enumerate(axes)}
            for name, column in row.items():
                columns.setdefault(name, []).append(column)
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    si = "rad" if robot.robot.measured == "bend" else "m"
    units = {name: "" if name in ("recording", "part") else "s" if name == "time" else si for name in whole}
    findings.table("data/predicted.csv", whole, units)
    findings.plain(
        "data/source.json",
        {"robot": robot.title, "citation": robot.citation, "parts": robot.parts, "in_sample": robot.in_sample},
    )


VALIDATE = Procedure("validate", plan, validate, completed=with_recordings, in_one_plane=no_tendons)
