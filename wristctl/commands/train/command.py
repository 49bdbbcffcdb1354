"""Networks from tip position to bend."""

from __future__ import annotations

import logging
import math
import shutil
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.gen_data.command import drawn, pulled_to_samples, recorded, samples_of
from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.commands.train.learned_dynamics import TrainedDynamics, check_dynamics, keep_dynamics
from wristctl.config.learning import NetworkSettings, TrainSettings
from wristctl.config.study import Study
from wristctl.errors import Argument, UserError
from wristctl.records import Run
from wristctl.records.files import check_plain

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.network import Network
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import Job, TrainingResult
    from wristctl.learning.transitions import Transitions

log = logging.getLogger(__name__)


CHECKPOINTS = "checkpoints"


def checkpoints_of(session: Session) -> Path | None:
    """Folder of the trainings' checkpoints, with those of the run to resume. None without a run."""
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
    samples: Samples | Transitions,
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
    trials: dict[str, list[TrainingResult]] = {}
    for trial in _train_all(session, "training", samples, jobs, checkpoints):
        trials.setdefault(trial.job.name.rpartition("-")[0], []).append(trial)
    return trials


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
    session: Session, activity: str, samples: Samples | Transitions, jobs: list[Job], checkpoints: Path | None
) -> list[TrainingResult]:
    """The jobs' trials, with progress and checkpoints."""
    import torch

    from wristctl.learning.training_processes import train_all
    from wristctl.learning.training_result import Epoch
    from wristctl.learning.transitions import Transitions
    from wristctl.processes import cores

    settings = session.study.train
    device = settings.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    workers = settings.workers or cores()
    session.findings.numerics(dtype="float64", torch_threads=1, device=device)
    epochs = [0] * len(jobs)
    with session.progress(activity, sum(job.settings.epochs for job in jobs), "epochs") as advance:

        def report(number: int, epoch: Epoch) -> None:
            epochs[number] = epoch.epoch
            rmse = math.sqrt(epoch.validation_loss)
            if isinstance(samples, Transitions):
                advance(sum(epochs), rmse_rad_s2=rmse)
            else:
                advance(sum(epochs), rmse_deg=math.degrees(rmse))

        return train_all(samples, jobs, workers, device, checkpoints, report)


@dataclass(frozen=True, repr=False, eq=False)
class Trained(StudyResult):
    """Networks from tip position [m] to bending angle [rad], and the one of them that is kept."""

    kind = "train"

    network: Network
    """The one with the least validation loss."""
    trials: dict[str, list[TrainingResult]]
    """Every training, by the name of its network."""
    samples: Samples
    split: Split
    choice: Choice | None
    """Choice of a search over the grid, with its reason. None without a search."""
    measures: pd.DataFrame
    kept: str
    """Name of the network that is kept."""
    errors: Table
    """Errors of the network, a polynomial and the closed form in every place."""
    data: str = ""
    """Path of the run with the samples; empty where there is none."""

    @property
    def answer(self) -> Answer:
        """Error on samples that no training has seen, beside the closed form's."""
        from wristctl.commands.train.results import answer_of

        kept, segments = (self.kept, len(self.trials)), self.network.segments
        return answer_of(self.errors, len(self.split.test), kept, self.place, self.data, segments)

    def frame(self) -> pd.DataFrame:
        """One row per network and seed: its errors on the test samples and elsewhere, losses and epochs."""
        return self.measures


def plan(study: Study, inputs: Inputs) -> str:
    """Plan of a training. Raises UserError without PyTorch, and for a split that leaves no samples to evaluate on."""
    import numpy as np

    from wristctl.learning.dataset import split_samples
    from wristctl.learning.selection import grid_points
    from wristctl.learning.transitions import Transitions

    if find_spec("torch") is None:
        fix = "pip install torch --index-url https://download.pytorch.org/whl/cpu"
        raise UserError("training needs PyTorch, which is not installed", "train", fix)
    settings, samples, held_out, whose = study.train, inputs.read("data", samples_of), None, None
    if study.gen_data.source == "transitions" if samples is None else isinstance(samples, Transitions):
        check_dynamics(settings)
    count, source = study.gen_data.drawn_samples, "samples of its own"
    if samples is None and study.gen_data.measured:
        samples = drawn(study, (0, 0), recorded(study, Inputs()))
    if samples is not None:
        _warn_of_another_wrist(study, inputs)
        run = inputs.runs().get("data")
        count, held_out = len(samples.targets), samples.held_out
        source = run.id if run else "those given" if "data" in inputs else source
        whose = recordings(samples, settings)
    split = split_samples(count, settings.train_share, np.random.default_rng(0), held_out, whose)
    shares = []
    if split.recording is not None:
        counts = [len(np.unique(split.recording[rows])) for rows in (split.train, split.validation, split.test)]
        shares = [f"of {sum(counts)} recordings {counts[0]}, {counts[1]} and {counts[2]}, each whole"]
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
            *shares,
        ]
    )


def _warn_of_another_wrist(study: Study, inputs: Inputs) -> None:
    """Warn of samples of a wrist that is not as the study says: a network learns theirs."""
    source = inputs.get("data")
    if source is None:
        return
    theirs = (source.config if isinstance(source, Run) else source.study).wrist
    own, given = study.wrist, study.wrist.model_fields_set
    differ = {key: (getattr(theirs, key), getattr(own, key)) for key in type(own).model_fields if key in given}
    each = [f"wrist.{key} is {there} there and {here} here" for key, (there, here) in differ.items() if there != here]
    if each:
        log.warning("the samples are of another wrist, which the network learns: %s", ", ".join(each))


def recordings(samples: Samples | Transitions, settings: TrainSettings) -> NDArray[np.int64] | None:
    """The recording of each sample where these are what is split, else None."""
    return samples.recording if settings.split == "recording" else None


def networks(settings: TrainSettings) -> dict[str, NetworkSettings]:
    """The networks to train by name: the rows, or the section's own without a name."""
    if not settings.rows:
        return {"": _network(settings)}
    return {row.name: _network(row) for row in settings.rows}


def _network(settings: NetworkSettings) -> NetworkSettings:
    fields = {name: getattr(settings, name) for name in NetworkSettings.model_fields}
    return NetworkSettings.model_construct(**fields)


def train(session: Session) -> Trained | TrainedDynamics:
    """Train networks from tip position to bend, or one of the dynamics where the samples are transitions."""
    import numpy as np

    from wristctl.commands.train import results
    from wristctl.learning.dataset import split_samples
    from wristctl.learning.evaluation import places
    from wristctl.learning.training_result import best_of
    from wristctl.learning.transitions import Transitions, draw_transitions

    settings, findings = session.study.train, session.findings
    samples = session.inputs.read("data", samples_of)
    if samples is None:
        study, entropy = session.study, findings.stream("samples")
        if study.gen_data.source == "transitions":
            samples = draw_transitions(study.gen_data, study.wrist, np.random.default_rng(entropy))
        else:
            samples = drawn(study, entropy, recorded(study, Inputs()))
        findings.arrays("data/samples.npz", samples.arrays())
    if isinstance(samples, Transitions):
        check_dynamics(settings)
    rng = np.random.default_rng(findings.stream("split"))
    whose = recordings(samples, settings)
    split = split_samples(len(samples.targets), settings.train_share, rng, samples.held_out, whose)
    checkpoints = checkpoints_of(session)
    if isinstance(samples, Transitions):
        return _of_dynamics(session, samples, split, checkpoints)

    began, choice, tables = time.perf_counter(), None, []
    wanted = networks(settings)
    if settings.search:
        choice = chosen_by_folds(session, samples, split, checkpoints)
        wanted = {"": choice.chosen.settings}
        tables += results.grid_tables(findings, choice)
    trials = train_networks(session, samples, split, wanted, checkpoints)
    seconds = time.perf_counter() - began

    name, row_trials = results.best_row(trials)
    kept = best_of(row_trials)
    results.keep_network(session, kept.network, name, choice.reason if choice else "")
    if any(trial.interrupted for row_results in trials.values() for trial in row_results):
        results.keep_curves(findings, row_trials)
        raise KeyboardInterrupt  # at once: to judge a network on very many samples takes longer than anybody waits
    where = places(samples, split)
    tables.append(results.trial_table(findings, row_trials, kept))
    measures = results.trials_frame(trials, where)
    tables += results.ranking_tables(findings, settings, trials, measures)
    errors = results.error_table(findings, kept, samples, split, where)
    tables.append(results.timing_table(findings, kept, samples, split, seconds))
    if checkpoints:
        shutil.rmtree(checkpoints, ignore_errors=True)
    data = session.inputs.runs().get("data")
    return Trained(
        session.study, findings, tables, kept.network, trials, samples, split, choice, measures, name, errors,
        str(data.path) if data else "",
    )  # fmt: skip


def _of_dynamics(session: Session, samples: Transitions, split: Split, checkpoints: Path | None) -> TrainedDynamics:
    """Train a network on transitions, and leave the controller over it."""
    source, wanted = session.inputs.get("data"), networks(session.study.train)
    (trials,) = train_networks(session, samples, split, wanted, checkpoints).values()
    known = source.config if isinstance(source, Run) else source.study if source else session.study
    result = keep_dynamics(session, samples, split, trials, known.wrist)
    if checkpoints:
        shutil.rmtree(checkpoints, ignore_errors=True)
    return result


TRAIN = Procedure(
    "train",
    plan,
    train,
    (
        EarlierRun("data", kind="gen-data", optional=True),
        EarlierRun("resume", kind="train", optional=True, unfinished=True),
    ),
    in_one_plane=pulled_to_samples,
)
