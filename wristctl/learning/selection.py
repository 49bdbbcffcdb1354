"""Choosing layers and activation: cross-validation over a grid, then the one-standard-error rule."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.learning import Activation, NetworkSettings, TrainSettings
from wristctl.errors import UserError
from wristctl.learning.dataset import Split
from wristctl.learning.ranking import LEVEL, holm
from wristctl.learning.training_result import Job, TrainingResult


@dataclass(frozen=True)
class CrossValidated:
    """Point of the grid with its errors on the folds."""

    settings: NetworkSettings
    depth: int
    multiply_adds: int
    rmse: Array
    """(folds,) RMSE of the angle on the part held out [rad]"""

    @property
    def mean(self) -> float:
        """Mean over the folds [rad]; infinite where one diverged."""
        return float(self.rmse.mean())

    @property
    def standard_error(self) -> float:
        """Standard error of the mean over the folds [rad]."""
        return float(self.rmse.std(ddof=1) / np.sqrt(len(self.rmse)))


@dataclass(frozen=True)
class Choice:
    """The whole grid, the chosen point of it, the one with the least error, and the reason in words."""

    found: Sequence[CrossValidated]
    chosen: CrossValidated
    best: CrossValidated
    reason: str


def grid_points(settings: TrainSettings) -> list[NetworkSettings]:
    """Every combination of the grid, with the section's own values elsewhere."""
    grid, fields = settings.grid, set(NetworkSettings.model_fields)
    base = settings.model_dump(include=fields, exclude={"preset"})
    rates = grid.learning_rates or (settings.learning_rate,)
    decays = grid.weight_decays or (settings.weight_decay,)
    return [
        NetworkSettings.model_validate(
            base | {"hidden": hidden, "activation": activation, "learning_rate": rate, "weight_decay": decay}
        )
        for activation, hidden, rate, decay in product(grid.activations, grid.layers(), rates, decays)
    ]


def fold_jobs(
    points: Sequence[NetworkSettings],
    split: Split,
    folds: int,
    seed: np.random.SeedSequence,
    recording: NDArray[np.int64] | None = None,
) -> list[Job]:
    """One training for each point and fold; training and validation samples are cut in `folds`, the test is not used.

    A fold has the same samples and the same random stream at every point. Where the samples are of recordings a fold
    has whole ones.
    """
    rows, seeds = np.concatenate([split.train, split.validation]), seed.spawn(folds)
    parts = np.array_split(rows, folds)
    if recording is not None:
        recordings = np.unique(recording[rows])
        if len(recordings) < folds:
            problem, fix = f"{len(recordings)} recordings are too few for {folds} folds", "measure more, or fewer folds"
            raise UserError(problem, "train.grid.folds", fix)
        parts = [rows[np.isin(recording[rows], part)] for part in np.array_split(recordings, folds)]
    if min(len(part) for part in parts) < 2:
        raise UserError(f"{len(rows)} samples are too few for {folds} folds", "train.grid.folds", "draw more samples")
    cuts = [Split(np.setdiff1d(rows, part, assume_unique=True), part, split.test) for part in parts]
    return [
        Job(f"grid-{number}-{fold}", settings, cut, seeds[fold], fold)
        for number, settings in enumerate(points)
        for fold, cut in enumerate(cuts)
    ]


def candidates(trials: Sequence[TrainingResult], folds: int) -> list[CrossValidated]:
    """The grid's points out of the trials of `fold_jobs`."""
    points = []
    for first in range(0, len(trials), folds):
        members = trials[first : first + folds]
        losses = np.array([trial.validation_loss for trial in members])
        rmse = np.sqrt(np.where(np.isfinite(losses), losses, np.inf))
        network = members[0].network
        points.append(CrossValidated(members[0].job.settings, len(network.weights) - 1, network.multiply_adds, rmse))
    return points


def choose(points: Sequence[CrossValidated]) -> Choice:
    """The network of the fewest multiply-adds within one standard error of the least error.

    Breiman et al., Classification and Regression Trees (1984), section 3.4. Raises UserError where all diverged.
    """
    finite = [point for point in points if np.isfinite(point.mean)]
    if not finite:
        raise UserError("every network of the grid diverged", "train.learning_rate", "choose less")
    best = min(finite, key=lambda point: point.mean)
    limit = best.mean + best.standard_error
    good = [point for point in finite if point.mean <= limit]
    chosen = min(good, key=lambda point: (point.multiply_adds, point.mean))
    reason = (
        f"{_named(chosen)} is the cheapest network ({chosen.multiply_adds} multiply-adds) whose cross-validated RMSE "
        f"({np.degrees(chosen.mean):.3g} deg) lies within one standard error ({np.degrees(best.standard_error):.2g} "
        f"deg) of the least ({np.degrees(best.mean):.3g} deg, {_named(best)})"
    )
    return Choice(points, chosen, best, reason)


def _named(candidate: CrossValidated) -> str:
    return f"{'-'.join(map(str, candidate.settings.hidden))} {candidate.settings.activation}"


# Hidden layers of the paper's network.
THREE = 3


@dataclass(frozen=True)
class Depth:
    """The network of least error of one depth, beside that of three layers."""

    best: CrossValidated
    p: float
    """paired t-test over the folds against three layers, corrected by Holm; nan for three itself"""
    than_three: Literal["better", "worse", "no difference shown", ""]
    """empty for three layers, and where there are none of three"""


@dataclass(frozen=True)
class DepthComparison:
    """The depths of one activation, fewest layers first."""

    activation: Activation
    depths: tuple[Depth, ...]
    three_is_best: bool | None
    """whether three layers are better than every other depth at LEVEL; None where there are none of three"""


def compare_depths(points: Sequence[CrossValidated]) -> list[DepthComparison]:
    """Every activation of a grid, in its order; all networks were judged on the same folds."""
    activations = dict.fromkeys(point.settings.activation for point in points)
    return [_compared(name, [point for point in points if point.settings.activation == name]) for name in activations]


def _compared(activation: Activation, points: Sequence[CrossValidated]) -> DepthComparison:
    from scipy.stats import ttest_rel

    least: dict[int, CrossValidated] = {}
    for point in points:
        if point.depth not in least or point.mean < least[point.depth].mean:
            least[point.depth] = point
    three, rivals = least.get(THREE), [depth for depth in least if depth != THREE]
    if three is None:
        return DepthComparison(activation, tuple(Depth(point, np.nan, "") for _, point in sorted(least.items())), None)
    p = [
        float(ttest_rel(least[depth].rmse, three.rmse).pvalue)
        if np.isfinite([least[depth].mean, three.mean]).all()
        else np.nan
        for depth in rivals
    ]
    corrected = dict(zip(rivals, holm(p), strict=True))
    depths = [_beside(point, three, corrected.get(depth, np.nan)) for depth, point in sorted(least.items())]
    best = all(least[depth].mean > three.mean and corrected[depth] < LEVEL for depth in rivals)
    return DepthComparison(activation, tuple(depths), best)


def _beside(point: CrossValidated, three: CrossValidated, p: float) -> Depth:
    if point is three:
        return Depth(point, p, "")
    if not p < LEVEL:
        return Depth(point, p, "no difference shown")
    return Depth(point, p, "better" if point.mean < three.mean else "worse")
