"""Rows in order within a class of conditions, or over the worlds of a family: what an answer in words is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.condition_classes import CLASSES, class_of
from wristctl.comparison.geometric_means import GeometricMean, geometric_mean, paired_ratio, penalised
from wristctl.comparison.statistics import spread
from wristctl.comparison.tie_groups import Standing, standing
from wristctl.comparison.world_ranking import FAILURE, WorldRanking
from wristctl.config.control import CompareSettings
from wristctl.config.wrist import WristParameters

_STREAM = 20_041
"""Of the resampling: the same rows give the same intervals."""
_INVERSES = ("none", "closed-form", "network")
"""Which of several a class is judged through: control is judged by itself, and a network's error by `train`."""


@dataclass(frozen=True)
class ClassStanding:
    """Rows over the cells of one class: every loop, motion and direction of it; or over the worlds of a family."""

    name: str
    cells: str
    """What they are, counted: 8 motions, 60 worlds."""
    labels: list[str]
    """controller/gains of each row."""
    loops: list[str]
    """Names of the loops that they are on."""
    scores: Array
    """RMSE [rad], (R, W); inf where the row failed."""
    standing: Standing
    means: list[GeometricMean]
    """Of each row's RMSE [rad]; a failure counts as 90 deg."""
    swing: Array
    """Half of the largest swing at rest [rad], (R,); 0 where all rest."""
    away: NDArray[np.int_]
    """In how many cells each row stays within its range and does not arrive, (R,)."""
    peak: Array
    """Largest tension of a row that is above what a tendon bears [N], (R,); 0 elsewhere."""

    @property
    def order(self) -> list[int]:
        """Rows from best to worst, those that cannot be relied on last."""
        return [row for group in self.standing.groups for row in group.rows] + self.standing.unreliable

    def group(self, row: int) -> int | None:
        """The number of a row's group, from 1; None where it fails or swings."""
        return next((at for at, each in enumerate(self.standing.groups, start=1) if row in each.rows), None)

    def best(self, controller: str) -> int | None:
        """The best row of a controller; None where it has none."""
        return next((row for row in self.order if self.labels[row].split("/")[0] == controller), None)

    def times_better(self, row: int, other: int) -> GeometricMean:
        """How many times less one row's RMSE is than another's in the same cells."""
        known = penalised(self.scores, FAILURE)
        return paired_ratio(known[other], known[row], _STREAM)


def class_standings(
    results: Sequence[ComparedRow], settings: CompareSettings, wrist: WristParameters
) -> list[ClassStanding]:
    """The rows of a comparison in each class of conditions that it has, in the order of CLASSES."""
    through = next(each for each in _INVERSES if any(result.inverse == each for result in results))
    classes = {name: class_of(loop, wrist) for name, loop in settings.loops.items()}
    own = [result for result in results if result.inverse == through]
    found = []
    for name in CLASSES:
        if here := [result for result in own if classes[result.loop] == name]:
            found.append(_standing(name, here))
    return found


def _standing(name: str, results: Sequence[ComparedRow]) -> ClassStanding:
    labels = list(dict.fromkeys(result.label for result in results))
    cells = list(dict.fromkeys((result.loop, result.reference) for result in results))
    at = {(each.label, each.loop, each.reference): each.repeated for each in results}
    table = [[at[label, *cell] for cell in cells] for label in labels]
    scores = np.array([[_score(each.failed, each.metrics["rmse"]) for each in row] for row in table])
    swing = np.array([[each.swing for each in row] for row in table])
    counted = f"{len(cells)} motion{'s' * (len(cells) > 1)}"
    return ClassStanding(
        name, counted, labels, list(dict.fromkeys(loop for loop, _ in cells)), scores,
        standing(scores, swing > 0.0, FAILURE, _STREAM, drawn=False),
        [geometric_mean(each, _STREAM) for each in penalised(scores, FAILURE)],
        swing.max(axis=1),
        np.array([sum(not each.arrives and not each.failed.any() for each in row) for row in table]),
        np.array([max(each.beyond for each in row) for row in table]),
    )  # fmt: skip


def _score(failed: NDArray[np.bool_], rmse: Array) -> float:
    """The median of repetitions; inf where one failed. An error of nothing at all is one of rounding."""
    return np.inf if failed.any() else max(spread(rmse).median, 1e-15)


def of_ranking(found: WorldRanking) -> ClassStanding:
    """The same of a ranking over worlds."""
    swings = [row.measured.metrics["oscillation"] * row.measured.swings for row in found.rows]
    none = np.zeros(len(found.rows))
    return ClassStanding(
        found.name, f"{found.worlds} worlds", [row.label for row in found.rows], [],
        np.array([row.rmse for row in found.rows]), found.standing, found.means,
        np.array([np.nanmax(each, initial=0.0) for each in swings]), none.astype(int), none,
    )  # fmt: skip
