"""Networks from tip position to bending angle."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.learning import NetworkSettings, TrainSettings
from wristctl.config.study import Study
from wristctl.studies.gen_data import drawn, samples_of
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult
from wristctl.studies.train_jobs import checkpoints_of, chosen_by_folds, train_networks
from wristctl.studies.train_outputs import (
    best_row,
    error_table,
    grid_tables,
    keep_curves,
    keep_network,
    timing_table,
    trial_table,
)
from wristctl.studies.train_ranking import ranking_tables, trials_frame

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.learning.dataset import Samples, Split
    from wristctl.learning.network import Network
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import TrainingResult


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
    """What a search over the grid chose, and why; None without one."""
    measures: pd.DataFrame

    def frame(self) -> pd.DataFrame:
        """One row per network and seed: its errors on the test samples and elsewhere, losses and epochs."""
        return self.measures


def plan(study: Study, inputs: Inputs) -> str:
    """What a run would train; a split that leaves no samples to judge by is an error here."""
    import numpy as np

    from wristctl.learning.dataset import split_samples
    from wristctl.learning.selection import grid_points

    settings, samples, held_out, whose = study.train, inputs.read("data", samples_of), None, None
    count, source = study.gen_data.samples, "samples of its own"
    if samples is not None:
        run = inputs.runs().get("data")
        count, source, held_out = len(samples.theta), run.id if run else "those given", samples.held_out
        whose = recordings(samples, settings)
    split = split_samples(count, settings.train_share, np.random.default_rng(0), held_out, whose)
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
            *([] if split.recording is None else [_shares(split, split.recording)]),
        ]
    )


def recordings(samples: Samples, settings: TrainSettings) -> NDArray[np.int64] | None:
    """The recording of each sample where these are what is split, else None."""
    return samples.recording if settings.split == "recording" else None


def _shares(split: Split, whose: NDArray[np.int64]) -> str:
    import numpy as np

    counts = [len(np.unique(whose[rows])) for rows in (split.train, split.validation, split.test)]
    return f"of {sum(counts)} recordings {counts[0]}, {counts[1]} and {counts[2]}, each whole"


def networks(settings: TrainSettings) -> dict[str, NetworkSettings]:
    """The networks to train by name: the rows, or the section's own without a name."""
    if not settings.rows:
        return {"": _network(settings)}
    return {row.name: _network(row) for row in settings.rows}


def _network(settings: NetworkSettings) -> NetworkSettings:
    fields = {name: getattr(settings, name) for name in NetworkSettings.model_fields}
    return NetworkSettings.model_construct(**fields)


def train(session: Session) -> Trained:
    """Train networks from tip position to bending angle."""
    import numpy as np

    from wristctl.learning.dataset import split_samples
    from wristctl.learning.evaluation import places
    from wristctl.learning.training_result import best_of

    settings, findings = session.study.train, session.findings
    samples = session.inputs.read("data", samples_of)
    if samples is None:
        samples = drawn(session.study, findings.stream("samples"), Inputs())
        findings.arrays("data/samples.npz", samples.arrays())
    rng = np.random.default_rng(findings.stream("split"))
    whose = recordings(samples, settings)
    split = split_samples(len(samples.theta), settings.train_share, rng, samples.held_out, whose)
    checkpoints = checkpoints_of(session)

    began, choice, tables = time.perf_counter(), None, []
    wanted = networks(settings)
    if settings.search:
        choice = chosen_by_folds(session, samples, split, checkpoints)
        wanted = {"": choice.chosen.settings}
        tables += grid_tables(findings, choice)
    trials = train_networks(session, samples, split, wanted, checkpoints)
    seconds = time.perf_counter() - began

    name, own = best_row(trials)
    kept = best_of(own)
    keep_network(session, kept.network, name, choice.reason if choice else "")
    if any(trial.interrupted for each in trials.values() for trial in each):
        keep_curves(findings, own)
        raise KeyboardInterrupt  # at once: to judge a network on very many samples takes longer than anybody waits
    where = places(samples, split)
    tables.append(trial_table(findings, own, kept))
    measures = trials_frame(trials, where)
    tables += ranking_tables(findings, settings, trials, measures)
    tables.append(error_table(findings, kept, samples, split, where))
    tables.append(timing_table(findings, kept, samples, split, seconds))
    if checkpoints:
        shutil.rmtree(checkpoints, ignore_errors=True)
    return Trained(session.study, findings, tables, kept.network, trials, samples, split, choice, measures)


TRAIN = Procedure(
    "train",
    plan,
    train,
    (
        EarlierRun("data", kind="gen-data", optional=True),
        EarlierRun("resume", kind="train", optional=True, unfinished=True),
    ),
)
