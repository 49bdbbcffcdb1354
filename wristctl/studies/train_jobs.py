"""The trainings of a study: their checkpoints, from which seeds they begin, over how many processes they go."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.config.errors import UserError
from wristctl.config.learning import NetworkSettings
from wristctl.config.wording import Argument
from wristctl.records.files import check_plain
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import Job, TrainingResult

CHECKPOINTS = "checkpoints"


def checkpoints_of(session: Session) -> Path | None:
    """Where the run keeps its trainings' checkpoints, with those of the run to resume; None without a run."""
    stopped, run = session.inputs.runs().get("resume"), session.findings.run
    if run is None:
        if stopped is not None:
            raise UserError("a training is resumed in a run directory", "train.resume", Argument("out", metavar="DIR"))
        return None
    if stopped is not None and (stopped.path / CHECKPOINTS).is_dir():
        shutil.copytree(stopped.path / CHECKPOINTS, run.path / CHECKPOINTS, copy_function=_copy_plain)
    return run.path / CHECKPOINTS


def _copy_plain(source: str, target: str) -> None:
    check_plain(Path(source))
    shutil.copyfile(source, target)


def train_networks(
    session: Session,
    samples: Samples,
    split: Split,
    wanted: dict[str, NetworkSettings],
    checkpoints: Path | None,
) -> dict[str, list[TrainingResult]]:
    """Every network from every seed; a seed begins all networks alike."""
    import numpy as np

    from wristctl.learning.training_result import Job

    seeds = [
        np.random.SeedSequence(session.findings.stream(f"training {trial}"))
        for trial in range(session.study.train.seeds)
    ]
    jobs = [
        Job(f"{name or 'network'}-{trial}", settings, split, seed, trial)
        for name, settings in wanted.items()
        for trial, seed in enumerate(seeds)
    ]
    found: dict[str, list[TrainingResult]] = {}
    for trial in _train_all(session, "training", samples, jobs, checkpoints):
        found.setdefault(trial.job.name.rpartition("-")[0], []).append(trial)
    return found


def chosen_by_folds(session: Session, samples: Samples, split: Split, checkpoints: Path | None) -> Choice:
    """The network of the grid that cross-validation chooses. Raises KeyboardInterrupt where it was cut short."""
    import numpy as np

    from wristctl.learning.selection import candidates, choose, fold_jobs, grid_points

    settings = session.study.train
    seed = np.random.SeedSequence(session.findings.stream("folds"))
    jobs = fold_jobs(grid_points(settings), split, settings.grid.folds, seed, split.recording)
    trials = _train_all(session, "cross-validation", samples, jobs, checkpoints)
    if len(trials) < len(jobs) or any(trial.interrupted for trial in trials):
        raise KeyboardInterrupt
    return choose(candidates(trials, settings.grid.folds))


def _train_all(
    session: Session, what: str, samples: Samples, jobs: list[Job], checkpoints: Path | None
) -> list[TrainingResult]:
    """The jobs' trials, with progress and checkpoints."""
    import numpy as np
    import torch

    from wristctl.lanes.cores import cores
    from wristctl.learning.processes import train_all
    from wristctl.learning.training_result import Epoch

    settings = session.study.train
    device = settings.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    workers = settings.workers or cores()
    session.findings.numerics(dtype="float64", torch_threads=1, device=device)
    epochs = [0] * len(jobs)
    with session.progress(what, sum(job.settings.epochs for job in jobs), "epochs") as done:

        def report(number: int, epoch: Epoch) -> None:
            epochs[number] = epoch.epoch
            done(sum(epochs), rmse_deg=np.degrees(np.sqrt(epoch.validation_loss)))

        return train_all(samples, jobs, workers, device, checkpoints, report)
