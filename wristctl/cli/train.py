"""`wristctl train`: a network from tip position to bending angle."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING

from wristctl.cli.command import Input, Session, Table, study_command
from wristctl.config.study import Study
from wristctl.runs import Run

if TYPE_CHECKING:
    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.network import Network
    from wristctl.learning.training import Epoch, Training
    from wristctl.wrist.kinematics import Array


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What a run would train; a split that leaves no samples to judge by is an error here."""
    import numpy as np

    from wristctl.learning.dataset import Samples, split_samples

    settings, data = study.train, inputs["data"]
    count = len(Samples.from_arrays(data.array("samples")).theta)
    split = split_samples(count, settings.train_share, np.random.default_rng(0))
    layers = "-".join(str(neurons) for neurons in settings.hidden)
    return (
        f"{settings.seeds} x {settings.epochs} epochs of a {layers} {settings.activation} network on {data.id}: "
        f"{len(split.train)} samples to train on, {len(split.validation)} to choose by, {len(split.test)} to judge by"
    )


def train(session: Session) -> list[Table]:
    """Train the network from tip position to bending angle."""
    import numpy as np

    from wristctl.learning import training
    from wristctl.learning.dataset import Samples, split_samples

    settings, run = session.settings, session.run
    samples = Samples.from_arrays(session.inputs["data"].array("samples"))
    split = split_samples(len(samples.theta), settings.train_share, np.random.default_rng(run.stream("split")))
    seeds = [np.random.SeedSequence(run.stream(f"training {trial}")) for trial in range(settings.seeds)]
    run.numerics(dtype="float64", torch_threads=1)

    began = time.perf_counter()
    with session.progress("training", settings.seeds * settings.epochs, "epochs") as done:

        def report(epoch: Epoch) -> None:
            count = epoch.trial * settings.epochs + epoch.epoch
            done(count, rmse_deg=np.degrees(np.sqrt(epoch.validation_loss)))

        trained = training.train(samples, split, settings, seeds, report)
    seconds = time.perf_counter() - began

    _write_network(session, trained.network)
    tables = [
        _write_curves(session, trained),
        _write_errors(session, trained.network, samples, split),
        _write_times(session, trained.network, samples.tip[split.test][:1000], seconds),
    ]
    if trained.interrupted:
        raise KeyboardInterrupt
    return tables


def _write_network(session: Session, network: Network) -> None:
    from wristctl.learning.network_file import save_network
    from wristctl.runs.files import sha256_of

    # The data is named by its hash: a run's id would make the same training give other bytes each time.
    record = {
        "seed": session.study.seed,
        "settings": session.settings.model_dump(mode="json", exclude={"data"}),
        "samples_sha256": sha256_of(session.inputs["data"].file("data/samples.npz")),
    }
    save_network(network, session.run.file("models/network.safetensors"), record)


def _write_curves(session: Session, trained: Training) -> Table:
    import numpy as np

    from wristctl.report.learning_figures import learning_curves
    from wristctl.report.learning_tables import MEANING, UNITS, curves_table

    run, curves = session.run, curves_table(trained.epochs)
    run.table("data/curves.csv", curves, UNITS, MEANING)
    run.figure("learning-curves", learning_curves(curves, trained.trial))
    run.metric(
        "gradient_norm",
        trained.gradient_norm,
        better="lower",
        meaning="norm of the gradient of the training loss (mean squared scaled angle) at the kept weights",
    )
    final = {epoch.trial: epoch for epoch in trained.epochs}.values()
    rows = [
        (e.trial, e.epoch, *np.degrees(np.sqrt([e.train_loss, e.validation_loss])).tolist(), e.trial == trained.trial)
        for e in final
    ]
    return Table("Trials", ("trial", "epochs", "training RMSE [deg]", "validation RMSE [deg]", "kept"), rows)


def _write_errors(session: Session, network: Network, samples: Samples, split: Split) -> Table:
    from wristctl.learning.metrics import MEASURES, angle_errors, error_map
    from wristctl.report.learning_figures import error_over_workspace, predicted_angles
    from wristctl.report.learning_tables import MEANING, UNITS, predictions_table
    from wristctl.wrist.kinematics import exact_angle

    run = session.run
    tip, theta = samples.tip[split.test], samples.theta[split.test]
    predictions = predictions_table(tip, theta, network.angle(tip), exact_angle(tip))
    run.table("data/predictions.csv", predictions, UNITS, MEANING)
    run.figure("predicted-angles", predicted_angles(predictions))

    grid = error_map(network.angle, samples.domain)
    run.arrays("data/error_map.npz", {"tip": grid.tip, "theta": grid.theta, "error": grid.error})
    run.figure("error-map", error_over_workspace(grid.tip, grid.error))

    rows = []
    for inverse, angle, prefix in (("network", network.angle, ""), ("exact inverse", exact_angle, "exact_")):
        for place, tips, true in (("test samples", tip, theta), ("whole workspace", grid.tip, grid.theta)):
            errors = angle_errors(angle(tips), true)
            rows.append((inverse, place, errors.r2, errors.rmse_deg, errors.max_error_deg, errors.close_share))
            begin = prefix if place == "test samples" else f"{prefix}workspace_"
            for name, (unit, better, meaning) in MEASURES.items():
                value = getattr(errors, name)
                run.metric(begin + name, value, unit, better, true.size, meaning=f"{inverse}, {place}: {meaning}")
    columns = ("inverse", "tips", "R^2", "RMSE [deg]", "max error [deg]", "within 0.5 deg [share]")
    return Table("Errors of the bending angle", columns, rows)


def _write_times(session: Session, network: Network, tip: Array, seconds: float) -> Table:
    from wristctl.learning.metrics import call_time
    from wristctl.wrist.kinematics import exact_angle

    rows = []
    for name, angle in (("network", network.angle), ("exact inverse", exact_angle)):
        rows.append((name, 1e6 * call_time(angle, tip[:1]), 1e6 * call_time(angle, tip) / len(tip)))
    times = {name: {"alone_us": alone, "batch_us": batch} for name, alone, batch in rows}
    record = {"training_s": seconds, "batch_size": len(tip), "per_angle": times}
    session.run.file("timing.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return Table("Time for one angle", ("inverse", "alone [us]", f"in a batch of {len(tip)} [us]"), rows)


app = study_command(
    "train",
    work=train,
    plan=plan,
    inputs=(Input("data", kind="gen-data"),),
    shortcuts=("epochs", "seeds"),
    examples=(
        "wristctl train experiments/paper.yaml --data latest:gen-data",
        "wristctl train --data latest:gen-data --set activation=relu --seeds 5",
    ),
)
