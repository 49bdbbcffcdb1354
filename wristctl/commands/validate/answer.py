"""What `validate` says of a real robot: errors beside its authors' own, what its recordings want, what they tell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer, rest
from wristctl.commands.printed_table import Table, joined
from wristctl.commands.quantities import told_table

if TYPE_CHECKING:
    from wristctl.identification.arc_fit import ArcFit
    from wristctl.identification.model_choice import TriedModel
    from wristctl.identification.prediction_scores import Score
    from wristctl.identification.real_robots import RealRobot


def validated_answer(
    robot: RealRobot, models: Sequence[TriedModel], chosen: TriedModel, run: str, beside: Mapping[str, Score]
) -> Answer:
    """The authors' own error in the first row, then those without a model, then ours.

    `run` is the path of the run, empty in memory; `beside` has the errors of predictions without a model, by name.
    """
    what = "bend" if robot.unit == "deg" else "tip"
    score, scale = chosen.score, robot.scale
    error, low, high = (f"{scale * value:.2f}" for value in score[:3])
    verb = "fits" if robot.in_sample else "predicts"
    comparison = ""
    if robot.authors:
        theirs = robot.authors[0][1]
        than = (
            "below" if scale * score.high < theirs else "above" if scale * score.low > theirs else "not told apart from"
        )
        comparison = f", {than} the {theirs:.2f} {robot.unit} of its authors' own model"
    sentence = (
        f"The model {verb} the {what} of {robot.title} to {error} {robot.unit} RMS (95 % {low} to {high}){comparison}."
    )
    notes: list[str | Table] = [
        wanted_terms(models),
        f"{robot.parts[0].upper()}{robot.parts[1:]}. {_caveats(robot, chosen)}",
    ]
    more = rest("Parameters, each recording, residuals", run)
    return Answer(sentence, models_table(robot, models, beside), notes, f"{robot.citation}. {more}")


def wanted_terms(models: Sequence[TriedModel]) -> str:
    """Which terms the data want, in words: each by the last model that adds it alone."""
    verdicts = {
        model.terms[-1]: model.verdict
        for model in models
        if model.without is not None and len(model.terms) == len(model.without.terms) + 1
    }
    by_verdict = {
        verdict: [term for term, judged in verdicts.items() if judged == verdict]
        for verdict in ("wanted", "unwanted", "not told")
    }
    wanted = joined(by_verdict["wanted"]) or f"nothing beside {models[0].words}"
    parts = [f"The data want {wanted}"]
    if by_verdict["unwanted"]:
        parts.append(f"predict worse with {joined(by_verdict['unwanted'])}")
    if by_verdict["not told"]:
        parts.append(f"do not tell whether there is {joined(by_verdict['not told'], 'or')}")
    return f"{'; they '.join(parts)}."


def _caveats(robot: RealRobot, chosen: TriedModel) -> str:
    """What the comparison is not."""
    parts = [f"The interval is by {chosen.score.blocks} blocks"]
    if robot.authors:
        parts.append(f"the model has {chosen.numbers} free numbers, more than its authors' own")
    if not robot.in_sample:
        parts.append("which terms it has was chosen by the same prediction")
    if robot.centred:
        parts.append("the mean error does not count, as its authors have it")
    return f"{'; '.join(parts)}."


def models_table(robot: RealRobot, models: Sequence[TriedModel], beside: Mapping[str, Score]) -> Table:
    """Errors of the authors' models and without a model, then of ours with the ratio to that without the last term."""
    rows = [(name, None, f"{error:.2f}", "", "") for name, error in robot.authors]
    for name, score in beside.items():
        error, low, high = (f"{robot.scale * value:.2f}" for value in score[:3])
        rows.append((name, None, f"{error} [{low}, {high}]", "", ""))
    return Table("", model_heads(robot.asked, robot.unit), [*rows, *model_rows(models, robot.scale)])


def model_heads(asked: str, unit: str) -> tuple[str, ...]:
    """Heads of the rows of `model_rows`, of an error of what was `asked`."""
    return "model", "free numbers", f"{asked} [{unit}]", "over that without the term", "term"


def model_rows(models: Sequence[TriedModel], scale: float) -> list[tuple[str, int, str, str, str]]:
    """Name, free numbers, error and ratio with intervals, verdict of each model; `scale` is of a unit over SI."""
    rows = []
    for model in models:
        digits = 2 if scale * model.score.error >= 0.1 else 4
        error, low, high = (f"{scale * value:.{digits}f}" for value in model.score[:3])
        ratio = "{:.3f} [{:.3f}, {:.3f}]".format(*model.ratio[:3]) if model.ratio else ""
        name = model.words.replace("elastic ", "")
        if len(model.terms) > 1 and model.terms[0] == "slack":
            name = f"+ {model.terms[-1]}" if len(model.terms) == 2 else "+ all that is wanted"
        rows.append((name, model.numbers, f"{error} [{low}, {high}]", ratio, model.verdict))
    return rows


def parameters_table(fits: Sequence[ArcFit]) -> Table:
    """Unknowns of a model with their 95 % intervals, or that the data do not tell them."""
    title, of_fits = "What the data tell of the chosen model", [told_table(fit.told) for fit in fits]
    if len(fits) == 1:
        return Table(title, of_fits[0].columns, of_fits[0].rows)
    rows = [(fit.recordings[0].name, *row) for fit, of_fit in zip(fits, of_fits, strict=True) for row in of_fit.rows]
    return Table(title, ("recording", *of_fits[0].columns), rows)


def steps_table(robot: RealRobot, steps: Sequence[ArcFit]) -> Table:
    """Errors of further recordings, over all of what was predicted and over its last second."""
    rows = []
    for step in steps:
        recording, wrong = step.recordings[0], step.errors[0]
        end = recording.time > recording.time[-1] - 1.0
        last = math.sqrt(float((wrong[end] ** 2).sum(axis=1).mean()))
        rows.append((recording.name, *(f"{robot.scale * error:.2f}" for error in (step.rms("asked"), last))))
    title = "Steps in a closed loop, predicted from the motors with the same fit; zero from the first 0.15 s, no slack"
    return Table(title, ("recording", f"RMS error [{robot.unit}]", "last second"), rows)
