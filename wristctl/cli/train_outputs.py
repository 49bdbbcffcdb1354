"""What `wristctl train` writes: the kept network, its errors beside the baselines, and what the seeds support."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from wristctl.cli.command import Session, Table

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.evaluation import Place
    from wristctl.learning.network import Network
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import TrainingResult


def write_results(
    session: Session,
    trials: dict[str, list[TrainingResult]],
    samples: Samples,
    split: Split,
    seconds: float,
    reason: str,
) -> list[Table]:
    """Everything about the trained networks, by name; `reason` says why the one network was chosen."""
    from wristctl.cli.train_ranking import write_rows
    from wristctl.learning.evaluation import places
    from wristctl.learning.training_result import best_of

    name, own = min(trials.items(), key=lambda item: min(_losses(item[1])))
    kept, where = best_of(own), places(samples, split)
    _write_network(session, kept.network, name, reason)
    tables = [
        _write_curves(session, own, kept),
        *write_rows(session, trials, where),
        _write_errors(session, kept, samples, split, where),
        _write_times(session, kept, samples, split, seconds),
    ]
    return tables


def write_choice(session: Session, choice: Choice) -> list[Table]:
    """The grid's cross-validation, a picture of accuracy against cost, and what it says of the layers."""
    from wristctl.cli.train_ranking import write_depths
    from wristctl.report.learning_figures import accuracy_against_cost
    from wristctl.report.learning_tables import GRID_UNITS, grid_table

    run, table = session.run, grid_table(choice.found)
    run.table("data/grid.csv", table, units=GRID_UNITS)
    run.figure("accuracy-against-cost", accuracy_against_cost(table, choice.found.index(choice.chosen)))
    run.summary(f"{choice.reason[0].upper()}{choice.reason[1:]}.")
    shown = table[["hidden", "activation", "learning_rate", "weight_decay", "multiply_adds", "rmse_deg", "error_deg"]]
    heads = ("layers", "activation", "rate", "decay", "multiply-adds", "RMSE [deg]", "standard error [deg]")
    rows = [tuple(row) for row in shown.itertuples(index=False)]
    return [Table(f"Cross-validation: {choice.reason}", heads, rows), *write_depths(session, choice)]


def _losses(trials: list[TrainingResult]) -> list[float]:
    from math import inf, isfinite

    return [trial.validation_loss if isfinite(trial.validation_loss) else inf for trial in trials]


def _write_network(session: Session, network: Network, name: str, reason: str) -> None:
    from wristctl.learning.network_file import save_network
    from wristctl.records.files import sha256_of

    # The data is named by its hash: a run's id would make the same training give other bytes each time.
    data = session.inputs.get("data")
    file = data.file("data/samples.npz") if data else session.run.path / "data" / "samples.npz"
    record = {
        "seed": session.study.seed,
        "settings": session.settings.model_dump(mode="json", exclude={"data", "resume", "workers"}),
        "samples_sha256": sha256_of(file),
    }
    record |= {"row": name} if session.settings.rows else {}
    record |= {"reason": reason} if reason else {}
    save_network(network, session.run.file("models/network.safetensors"), record)


def _write_curves(session: Session, trials: list[TrainingResult], kept: TrainingResult) -> Table:
    import numpy as np

    from wristctl.report.learning_figures import learning_curves
    from wristctl.report.learning_tables import MEANING, UNITS, curves_table

    run = session.run
    curves: pd.DataFrame = curves_table([epoch for trial in trials for epoch in trial.epochs])
    run.table("data/curves.csv", curves, UNITS, MEANING)
    run.figure("learning-curves", learning_curves(curves, kept.job.trial))
    run.metric(
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


def _write_errors(session: Session, kept: TrainingResult, samples: Samples, split: Split, where: list[Place]) -> Table:
    from wristctl.learning.angle_errors import MEASURES, angle_errors, error_map
    from wristctl.learning.evaluation import inverses
    from wristctl.report.learning_figures import error_over_workspace, errors_at_samples, predicted_angles
    from wristctl.report.learning_tables import MEANING, UNITS, predictions_table

    run, network, test = session.run, kept.network, where[0]
    beside = inverses(kept, samples, split)
    angles = [angle(test.inputs) for angle, _, _ in beside.values()]
    predictions = predictions_table(test.inputs, samples.names, test.theta, *angles)
    run.table("data/predictions.csv", predictions, UNITS, MEANING)
    run.figure("predicted-angles", predicted_angles(predictions))
    if samples.curvature_is_constant:
        grid = error_map(network.angle, samples.domain)
        run.arrays("data/error_map.npz", {"tip": grid.tip, "theta": grid.theta, "error": grid.error})
        run.figure("error-map", error_over_workspace(grid.tip, grid.error))
    else:
        run.figure("error-map", errors_at_samples(test.inputs[:, :2], angles[0] - test.theta))

    rows, rmse = [], {}
    for name, (angle, parameters, multiply_adds) in beside.items():
        for place in where:
            errors = angle_errors(angle(place.inputs), place.theta)
            rmse[name, place.name] = errors.rmse_deg
            shown = (errors.r2, errors.rmse_deg, errors.max_error_deg, errors.close_share)
            rows.append((name, place.name, *shown, parameters, multiply_adds))
            begin = {"network": "", "polynomial": "polynomial_", "exact inverse": "exact_"}[name]
            begin += {"test samples": "", "whole workspace": "workspace_"}.get(place.name, f"{_key(place.name)}_")
            for measure, (unit, better, meaning) in MEASURES.items():
                value = getattr(errors, measure)
                text = f"{name}, {place.name}: {meaning}"
                run.metric(begin + measure, value, unit, better, place.theta.size, meaning=text)
        run.metric(f"{_key(name)}_parameters", parameters, better="lower", meaning=f"{name}: fitted numbers")
        run.metric(f"{_key(name)}_multiply_adds", multiply_adds, better="lower", meaning=f"{name}: of one angle (C13)")
    if not samples.curvature_is_constant:
        for place in where:
            ratio = rmse["network", place.name] / rmse["exact inverse", place.name]
            meaning = f"{place.name}: network's RMSE over the exact inverse's"
            run.metric(f"rmse_over_exact_{_key(place.name)}", ratio, "1", "lower", place.theta.size, meaning=meaning)
            verdict = "at most a tenth of" if ratio <= 0.1 else "NOT down to a tenth of"
            run.summary(f"On {place.name} the network's RMSE is {verdict} the exact inverse's ({ratio:.3g} of it).")
    columns = ("inverse", "inputs", "R^2", "RMSE [deg]", "max error [deg]", "within 0.5 deg [share]", "parameters")
    return Table("Errors of the bending angle", (*columns, "multiply-adds"), rows)


def _write_times(session: Session, kept: TrainingResult, samples: Samples, split: Split, seconds: float) -> Table:
    from wristctl.learning.baseline import Polynomial
    from wristctl.learning.inference import compiled_exact, compiled_network, compiled_polynomial, microseconds

    inputs = samples.inputs[split.test]
    columns = kept.network.sizes[0]
    polynomial = Polynomial.fit(samples.inputs[split.train], samples.theta[split.train])
    timed = (
        ("network", compiled_network(kept.network), inputs[:, :columns]),
        ("polynomial", compiled_polynomial(polynomial), inputs),
        ("exact inverse, 2 atan2(y, x)", compiled_exact, inputs),
    )
    rows = [(name, microseconds(angles, given)) for name, angles, given in timed]
    record = {"training_s": seconds, "compiled_us_per_angle": dict(rows)}
    session.run.file("timing.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return Table("Time for one angle in compiled code on this machine (C13)", ("inverse", "median [us]"), rows)


def _key(name: str) -> str:
    return name.replace(" ", "_").replace("-", "_")
