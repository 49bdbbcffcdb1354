"""Results of a training: its answer, the kept network, its errors beside the baselines, and the tests over seeds."""

from __future__ import annotations

import math
import shlex
from typing import TYPE_CHECKING

import numpy as np

from wristctl.commands.answer import Answer
from wristctl.commands.gen_data.answer import CLOSED_FORM
from wristctl.commands.printed_table import Table, degrees
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.commands.train.tables import GRID_UNITS, MEANING, UNITS, curves_table, grid_table, predictions_table
from wristctl.comparison.paper import T1
from wristctl.comparison.repetition_spread import spread
from wristctl.config.learning import TrainSettings
from wristctl.learning.dataset import Samples, Split
from wristctl.learning.evaluation import ANGLE_MEASURES, MEASURES, Place, error_map, inverses, measures, size_of
from wristctl.learning.inference import (
    Polynomial,
    compiled_exact,
    compiled_network,
    compiled_polynomial,
    microseconds,
)
from wristctl.learning.network import Network
from wristctl.learning.network_file import NETWORK, save_network
from wristctl.learning.ranking import LEVEL, mean_interval, rank, trained_alike
from wristctl.learning.selection import THREE, Choice, compare_depths
from wristctl.learning.training_result import TrainingResult
from wristctl.records.files import sha256_of

if TYPE_CHECKING:
    import pandas as pd


def trials_frame(trials: dict[str, list[TrainingResult]], where: list[Place]) -> pd.DataFrame:
    """A row for each training of each network: every measure that these data have."""
    import pandas as pd

    records = [
        {"row": name, "trial": trial.job.trial} | measures(trial, where)
        for name, results in trials.items()
        for trial in results
    ]
    return pd.DataFrame(records).dropna(axis="columns", how="all")


def ranking_tables(
    findings: Findings, settings: TrainSettings, trials: dict[str, list[TrainingResult]], table: pd.DataFrame
) -> list[Table]:
    """Mean and 95 % interval of every measure over the seeds of each network, and what ranking they support."""
    meaning = {name: text for name, (_, text) in MEASURES.items()}
    findings.table("data/trials.csv", table, {name: unit for name, (unit, _) in MEASURES.items()}, meaning)
    if len(table) < 2:
        return []
    shown, count = [name for name in MEASURES if name in table], settings.seeds
    rows = []
    for name, row in table.groupby("row", sort=False):
        for measure in shown:
            mean, low, high = mean_interval(row[measure].to_numpy())
            unit, text = MEASURES[measure]
            says = f"{name}: {text}; mean over the seeds with its 95 % interval"
            ends = (low, high) if len(row) > 1 else None
            findings.metric(f"{name}_mean_{measure}", mean, unit, n=len(row), interval=ends, meaning=says)
            middle = spread(row[measure].to_numpy())
            says = f"{name}: {text}; median over the seeds with its 95 % interval by order statistics"
            findings.metric(f"{name}_median_{measure}", middle.median, unit, "", middle.n, middle.interval, says)
            rows.append((name, measure, unit, mean, low, high, middle.median, _printed(settings, str(name), measure)))
    heads = ("network", "measure", "unit", "mean", "95 % low", "95 % high", "median", "paper's T1")
    title = f"Over {count} seed{'s' * (count > 1)} (initial weights and order of samples; one split)"
    tables = [Table(title, heads, rows)]
    complete = min(len(results) for results in trials.values()) == count
    if count < 2 or not complete:
        return tables
    alike = trained_alike({name: results[0].job.settings for name, results in trials.items()})
    return tables + [_ranked(findings, settings, table, label, names) for label, names in alike.items()]


def depth_table(findings: Findings, choice: Choice) -> Table:
    """C15: the error of each depth for each activation, and whether three layers are better than others."""
    rows = []
    for compared in compare_depths(choice.found):
        activation = compared.activation
        for comparison in compared.depths:
            depth, folds, rmse = (
                comparison.best.depth,
                len(comparison.best.rmse),
                float(np.degrees(comparison.best.mean)),
            )
            rows.append((activation, depth, comparison.best.multiply_adds, rmse, comparison.p, comparison.than_three))
            says = f"C15: cross-validated RMSE of {depth} hidden layers, {activation}"
            findings.metric(f"c15_{activation}_depth_{depth}_rmse_deg", rmse, "deg", "lower", folds, meaning=says)
            if depth != THREE:
                says = "C15: paired t-test over the folds against three layers, Holm's correction"
                findings.metric(f"c15_{activation}_depth_{depth}_p", comparison.p, "", n=folds, meaning=says)
        if compared.three_is_best is not None:
            says = f"C15: 1 where three layers of {activation} are better than every other depth at the 5 % level"
            folds = len(choice.chosen.rmse)
            findings.metric(f"c15_{activation}_three_is_best", int(compared.three_is_best), n=folds, meaning=says)
    findings.metric("c15_chosen_depth", choice.chosen.depth, meaning="C15: hidden layers of the chosen network")
    findings.metric(
        "c15_best_depth", choice.best.depth, meaning="C15: hidden layers of the least cross-validated error"
    )
    heads = ("activation", "hidden layers", "multiply-adds", "RMSE [deg]", "p against 3", "than 3 layers")
    return Table("Are three hidden layers the best trade-off (C15)?", heads, rows)


def _ranked(findings: Findings, settings: TrainSettings, table: pd.DataFrame, label: str, names: list[str]) -> Table:
    """C16: the order of the rows by their error on the test samples, and which differences the seeds support."""
    count = settings.seeds
    ranking = rank({name: table.loc[table["row"] == name, "rmse_deg"].to_numpy() for name in names})
    for place, name in enumerate(ranking.order, start=1):
        findings.metric(f"{name}_rank_{label}", place, n=count, meaning=f"place by mean RMSE among {label}")
    says = f"Friedman's test that all of {label} are alike"
    findings.metric(f"friedman_p_{label}", ranking.friedman_p, n=count, meaning=says)
    rows = []
    for pair in ranking.pairs:
        rows.append((pair.better, pair.worse, pair.difference, pair.p, pair.p < LEVEL))
        says = "RMSE: Wilcoxon's signed-rank test over the seeds, Holm's correction"
        findings.metric(f"p_{pair.better}_before_{pair.worse}", pair.p, n=count, meaning=says)
    rows_by_name = {row.name: row for row in settings.rows}
    for name in (name for name in names if rows_by_name[name].activation == "sigmoid"):
        says = f"C16: 1 where sigmoid's RMSE is below every other's of {label} at the 5 % level"
        findings.metric(f"c16_{name}_is_best", int(ranking.supports_best(name)), n=count, meaning=says)
        says = f"C16: 1 where some other's RMSE of {label} is below sigmoid's at the 5 % level"
        findings.metric(f"c16_{name}_is_beaten", int(ranking.supports_better(name)), n=count, meaning=says)
    heads = ("better", "worse", "median difference of RMSE [deg]", "p", "supported")
    title = f"Ranking of {label}: {' < '.join(ranking.order)} by mean RMSE; Friedman p = {ranking.friedman_p:.2g}"
    return Table(title, heads, rows)


def _printed(settings: TrainSettings, name: str, measure: str) -> float | None:
    """T1's cell for a row with one of its presets."""
    row = next((row for row in settings.rows if row.name == name), settings)
    column = T1.get((row.preset or "").removeprefix("t1-"))
    return getattr(column, measure, None) if column else None


def best_row(trials: dict[str, list[TrainingResult]]) -> tuple[str, list[TrainingResult]]:
    """The network whose best training has the least validation loss, and all its trainings."""

    def least(results: list[TrainingResult]) -> float:
        losses = [result.validation_loss for result in results]
        return min((loss for loss in losses if math.isfinite(loss)), default=math.inf)

    return min(trials.items(), key=lambda item: least(item[1]))


def grid_tables(findings: Findings, choice: Choice) -> list[Table]:
    """The grid's cross-validation, a picture of accuracy against cost, and what it says of the layers."""
    from wristctl.commands.train.figures import accuracy_against_cost

    table = grid_table(choice.found)
    findings.table("data/grid.csv", table, units=GRID_UNITS)
    findings.figure("accuracy-against-cost", accuracy_against_cost, table, choice.found.index(choice.chosen))
    findings.summary(f"{choice.reason[0].upper()}{choice.reason[1:]}.")
    shown = table[["hidden", "activation", "learning_rate", "weight_decay", "multiply_adds", "rmse_deg", "error_deg"]]
    heads = ("layers", "activation", "rate", "decay", "multiply-adds", "RMSE [deg]", "standard error [deg]")
    rows = [tuple(row) for row in shown.itertuples(index=False)]
    return [Table(f"Cross-validation: {choice.reason}", heads, rows), depth_table(findings, choice)]


def keep_network(session: Session, network: Network, name: str, reason: str) -> None:
    """The network's file, with a record of its training; `reason` says why it was chosen."""
    run, settings = session.findings.run, session.study.train
    if run is None:
        return
    # The data is named by its hash: a run's id would make the same training give other bytes each time.
    data = session.inputs.runs().get("data")
    samples = (data.path if data else run.path) / "data" / "samples.npz"
    record = {
        "seed": session.study.seed,
        "settings": settings.model_dump(mode="json", exclude={"data", "resume", "workers"}),
        "samples_sha256": sha256_of(samples),
    }
    record |= {"row": name} if settings.rows else {}
    record |= {"reason": reason} if reason else {}
    save_network(network, run.file(NETWORK), record)


def keep_curves(findings: Findings, trials: list[TrainingResult]) -> pd.DataFrame:
    """curves.csv: the errors of every training over its epochs."""
    curves: pd.DataFrame = curves_table([epoch for trial in trials for epoch in trial.epochs])
    findings.table("data/curves.csv", curves, UNITS, MEANING)
    return curves


def trial_table(findings: Findings, trials: list[TrainingResult], kept: TrainingResult) -> Table:
    """The course of every training of the kept network."""
    from wristctl.commands.train.figures import learning_curves

    curves = keep_curves(findings, trials)
    findings.figure("learning-curves", learning_curves, curves, kept.job.trial)
    findings.metric(
        "gradient_norm",
        kept.gradient_norm,
        better="lower",
        meaning="norm of the gradient of the training loss (mean squared scaled angle) at the kept weights",
    )
    rows = [
        (
            trial.job.trial,
            len(trial.epochs),
            *np.degrees(np.sqrt([trial.epochs[-1].train_loss, trial.validation_loss])).tolist(),
            trial is kept,
        )
        for trial in trials
    ]
    return Table("Trials", ("trial", "epochs", "training RMSE [deg]", "validation RMSE [deg]", "kept"), rows)


def error_table(findings: Findings, kept: TrainingResult, samples: Samples, split: Split, where: list[Place]) -> Table:
    """Errors of the kept network, a polynomial and the exact inverse in every place."""
    from wristctl.commands.train.figures import (
        error_over_workspace,
        errors_over_bends,
        predicted_angles,
        worst_over_lengths,
    )

    network, test = kept.network, where[0]
    beside = inverses(kept, samples, split)
    angles = [angle(test.inputs) for angle, _, _ in beside.values()]
    predictions = predictions_table(test.inputs, samples.names, test.theta, *angles)
    findings.table("data/predictions.csv", predictions, UNITS, MEANING)
    findings.figure("predicted-angles", predicted_angles, predictions)
    if samples.curvature_is_constant:
        grid = error_map(network.angle, samples.domain)
        findings.arrays("data/error_map.npz", {"tip": grid.tip, "theta": grid.theta, "error": grid.error})
        if samples.planes == 2:
            findings.figure("error-map", errors_over_bends, *worst_over_lengths(grid))
        else:
            findings.figure("error-map", error_over_workspace, grid.tip, grid.error)
    elif samples.planes == 2:
        findings.figure("error-map", errors_over_bends, test.theta, size_of(angles[0] - test.theta, 2))
    else:
        findings.figure("error-map", error_over_workspace, test.inputs[:, :2], angles[0] - test.theta)

    rows, rmse = [], {}
    for name, (angle, parameters, multiply_adds) in beside.items():
        for place in where:
            errors = place.errors(angle(place.inputs))
            rmse[name, place.name] = errors.rmse_deg
            shown = (errors.r2, errors.rmse_deg, errors.max_error_deg, errors.close_share)
            of_planes = (errors.rmse_ulnar_deg, errors.rmse_flexion_deg) if samples.planes == 2 else ()
            rows.append((name, place.name, *shown, parameters, multiply_adds, *of_planes))
            begin = {"network": "", "polynomial": "polynomial_", "exact inverse": "exact_"}[name]
            begin += {"test samples": "", "whole workspace": "workspace_"}.get(place.name, f"{_key(place.name)}_")
            for measure, value in errors.known().items():
                unit, better, meaning = ANGLE_MEASURES[measure]
                text = f"{name}, {place.name}: {meaning}"
                findings.metric(begin + measure, value, unit, better, place.count, meaning=text)
        findings.metric(f"{_key(name)}_parameters", parameters, better="lower", meaning=f"{name}: fitted numbers")
        findings.metric(
            f"{_key(name)}_multiply_adds", multiply_adds, better="lower", meaning=f"{name}: of one angle (C13)"
        )
    findings.headline("rmse_deg", "max_error_deg", "workspace_rmse_deg", "exact_rmse_deg", "polynomial_rmse_deg", "r2")
    if not samples.curvature_is_constant:
        for place in where:
            ratio = rmse["network", place.name] / rmse["exact inverse", place.name]
            meaning = f"{place.name}: network's RMSE over the exact inverse's"
            findings.metric(f"rmse_over_exact_{_key(place.name)}", ratio, "1", "lower", place.count, meaning=meaning)
            verdict = "at most a tenth of" if ratio <= 0.1 else "NOT down to a tenth of"
            findings.summary(
                f"On {place.name} the network's RMSE is {verdict} the exact inverse's ({ratio:.3g} of it)."
            )
    columns = (
        "inverse", "inputs", "R^2", "RMSE [deg]", "max error [deg]", "within 0.5 deg [share]", "parameters",
        "multiply-adds",
    )  # fmt: skip
    if samples.planes == 2:
        return Table("Errors of the bend, over both planes", (*columns, *OF_PLANES), rows)
    return Table("Errors of the bending angle", columns, rows)


def timing_table(findings: Findings, kept: TrainingResult, samples: Samples, split: Split, seconds: float) -> Table:
    """Time to compute one angle. `seconds` is the time of the training [s]."""
    inputs = samples.inputs[split.test]
    columns = kept.network.sizes[0]
    polynomial = Polynomial.fit(samples.inputs[split.train], samples.theta[split.train])
    timed = (
        ("network", compiled_network(kept.network), inputs[:, :columns]),
        ("polynomial", compiled_polynomial(polynomial), inputs),
        (f"exact inverse, {CLOSED_FORM[samples.planes]}", compiled_exact, inputs[:, : samples.planes + 1]),
    )
    rows = [(name, microseconds(angles, points)) for name, angles, points in timed]
    findings.plain("timing.json", {"training_s": seconds, "compiled_us_per_angle": dict(rows)})
    return Table("Time for one angle in compiled code on this machine (C13)", ("inverse", "median [us]"), rows)


def _key(name: str) -> str:
    return name.replace(" ", "_").replace("-", "_")


# Heads of the errors in each of two planes, last in the table of errors.
OF_PLANES = ("ulnar [deg]", "flexion [deg]")

# The closed form's name in the table of errors.
_CLOSED_FORM = "exact inverse"


def answer_of(
    errors: Table, held_out: int, kept: tuple[str, int], run: str, data: str = "", segments: int = 1
) -> Answer:
    """What the network is worth on `held_out` test samples.

    `errors` has a row for each inverse and place, as `error_table` makes it. `kept` is the name of the one of so many
    networks; `run` is the path of the run, empty in memory; `data` that of the run with the samples, empty where the
    training drew its own, of a wrist of so many segments.
    """
    from wristctl.learning.network_file import NETWORK

    name, networks = kept
    planes = 2 if errors.columns[-2:] == OF_PLANES else 1
    network, closed = (next(row for row in errors.rows if row[0] == inverse) for inverse in ("network", _CLOSED_FORM))
    over = ""
    if planes == 2:
        ulnar, flexion = map(_deg, network[-2:])
        over = f" over both planes ({ulnar} deg toward ulnar, {flexion} deg toward flexion)"
    sentence = (
        f"On {held_out} samples that it was not trained on the network{f' {name}' * (networks > 1)} has an RMSE of "
        f"{_deg(network[3])} deg{over}, at most {_deg(network[4])} deg off. The closed form {CLOSED_FORM[planes]} has "
        f"one of {_deg(closed[3])} deg, at most {_deg(closed[4])} deg off."
    )
    notes = [f"It is the one of {networks} networks with the least validation loss."] * (networks > 1)
    if run:
        cut = ["--set", "loop.planes=2"] * (planes == 2) + ["--set", f"loop.plant_segments={segments}"] * (segments > 1)
        words = ["wristctl", "simulate", f"{data or run}/config.yaml", "--set", "reference.inverse=network", *cut]
        notes += ["Next, one motion of this wrist through this network:", f"$ {shlex.join([*words, '--network', run])}"]
    more = f"All tables: --all. The network: {run}/{NETWORK}" if run else "All tables: `.tables`."
    return Answer(sentence, errors, notes, more)


def _deg(error_deg: float) -> str:
    return degrees(math.radians(error_deg)) if math.isfinite(error_deg) else "-"
