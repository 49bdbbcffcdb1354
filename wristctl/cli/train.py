"""`wristctl train`: networks from tip position to bending angle."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.learning import NetworkSettings, TrainSettings
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import Job, TrainingResult

CHECKPOINTS = "checkpoints"


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What a run would train; a split that leaves no samples to judge by is an error here."""
    import numpy as np

    from wristctl.learning.dataset import Samples, split_samples
    from wristctl.learning.selection import grid_points

    settings, data, held_out = study.train, inputs.get("data"), None
    count, source = study.gen_data.samples, "samples of its own"
    if data is not None:
        samples = Samples.from_arrays(data.array("samples"))
        count, source, held_out = len(samples.theta), data.id, samples.held_out
    split = split_samples(count, settings.train_share, np.random.default_rng(0), held_out)
    lines = [
        f"{settings.seeds} x {row.epochs} epochs of a {'-'.join(map(str, row.hidden))} {row.activation} network"
        + (f" ({name})" if name else "")
        for name, row in networks(settings).items()
    ]
    if settings.search:
        points, folds = len(grid_points(settings)), settings.grid.folds
        lines = [f"{points} networks x {folds} folds, then {settings.seeds} x the chosen one"]
    return "\n".join(
        [
            *lines,
            f"on {source}: {len(split.train)} samples to train on, {len(split.validation)} to choose by, "
            f"{len(split.test)} to judge by",
        ]
    )


def networks(settings: TrainSettings) -> dict[str, NetworkSettings]:
    """The networks to train by name: the rows, or the section's own without a name."""
    if not settings.rows:
        return {"": _network(settings)}
    return {row.name: _network(row) for row in settings.rows}


def _network(settings: NetworkSettings) -> NetworkSettings:
    fields = {name: getattr(settings, name) for name in NetworkSettings.model_fields}
    return NetworkSettings.model_construct(**fields)


def train(session: Session) -> list[Table]:
    """Train networks from tip position to bending angle."""
    import numpy as np

    from wristctl.cli.gen_data import drawn
    from wristctl.cli.train_outputs import write_choice, write_results
    from wristctl.learning.dataset import Samples, split_samples

    settings, run = session.settings, session.run
    if "data" in session.inputs:
        samples = Samples.from_arrays(session.inputs["data"].array("samples"))
    else:
        samples = drawn(session.study, run.stream("samples"), {})
        run.arrays("data/samples.npz", samples.arrays())
    rng = np.random.default_rng(run.stream("split"))
    split = split_samples(len(samples.theta), settings.train_share, rng, samples.held_out)
    if "resume" in session.inputs and (stopped := session.inputs["resume"].path / CHECKPOINTS).is_dir():
        shutil.copytree(stopped, run.path / CHECKPOINTS)

    began, choice, tables = time.perf_counter(), None, []
    wanted = networks(settings)
    if settings.search:
        choice = _searched(session, samples, split)
        wanted = {"": choice.chosen.settings}
        tables += write_choice(session, choice)
    trials = _trained(session, samples, split, wanted)
    seconds = time.perf_counter() - began
    tables += write_results(session, trials, samples, split, seconds, choice.reason if choice else "")
    if any(trial.interrupted for each in trials.values() for trial in each):
        raise KeyboardInterrupt
    shutil.rmtree(run.path / CHECKPOINTS, ignore_errors=True)
    return tables


def _trained(
    session: Session, samples: Samples, split: Split, wanted: dict[str, NetworkSettings]
) -> dict[str, list[TrainingResult]]:
    """Every network from every seed; a seed begins all networks alike."""
    import numpy as np

    from wristctl.learning.training_result import Job

    count, run = session.settings.seeds, session.run
    seeds = [np.random.SeedSequence(run.stream(f"training {trial}")) for trial in range(count)]
    jobs = [
        Job(f"{name or 'network'}-{trial}", settings, split, seed, trial)
        for name, settings in wanted.items()
        for trial, seed in enumerate(seeds)
    ]
    trials = _done(session, "training", samples, jobs)
    found: dict[str, list[TrainingResult]] = {}
    for trial in trials:
        found.setdefault(trial.job.name.rpartition("-")[0], []).append(trial)
    return found


def _searched(session: Session, samples: Samples, split: Split) -> Choice:
    import numpy as np

    from wristctl.learning.selection import candidates, choose, fold_jobs, grid_points

    folds = session.settings.grid.folds
    seed = np.random.SeedSequence(session.run.stream("folds"))
    jobs = fold_jobs(grid_points(session.settings), split, folds, seed)
    trials = _done(session, "cross-validation", samples, jobs)
    if len(trials) < len(jobs) or any(trial.interrupted for trial in trials):
        raise KeyboardInterrupt
    return choose(candidates(trials, folds))


def _done(session: Session, what: str, samples: Samples, jobs: list[Job]) -> list[TrainingResult]:
    """The jobs' trials, with progress and checkpoints."""
    import numpy as np
    import torch

    from wristctl.lanes.cores import cores
    from wristctl.learning.processes import train_all
    from wristctl.learning.training_result import Epoch

    settings, run = session.settings, session.run
    device = settings.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    workers = settings.workers or cores()
    run.numerics(dtype="float64", torch_threads=1, device=device)
    epochs = [0] * len(jobs)
    checkpoints: Path = run.path / CHECKPOINTS
    with session.progress(what, sum(job.settings.epochs for job in jobs), "epochs") as done:

        def report(number: int, epoch: Epoch) -> None:
            epochs[number] = epoch.epoch
            done(sum(epochs), rmse_deg=np.degrees(np.sqrt(epoch.validation_loss)))

        return train_all(samples, jobs, workers, device, checkpoints, report)


app = study_command(
    "train",
    work=train,
    plan=plan,
    inputs=(
        EarlierRun("data", kind="gen-data", optional=True),
        EarlierRun("resume", kind="train", optional=True, unfinished=True),
    ),
    shortcuts=("search", "preset", "epochs", "seeds", "device"),
    examples=(
        "wristctl train experiments/paper.yaml --data latest:gen-data",
        "wristctl train --preset recommended --seeds 5",
        "wristctl train experiments/table1.yaml",
        "wristctl train --search experiments/model_selection.yaml",
    ),
)
