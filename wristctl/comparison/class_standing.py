"""Rows in order within a class of conditions, or over the worlds of a family: what an answer in words is made of.

Steps and smooth motions are judged apart: a jump's error is much the same for every law, and would hide all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import (  # fmt: skip
    MEASURABLE,
    GeometricMean,
    geometric_mean,
    paired_ratio,
    penalised,
)
from wristctl.comparison.combinations import CLASSES, ComparedRow, class_of
from wristctl.comparison.tie_groups import Standing, standing
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.config.compare import CompareSettings
from wristctl.config.wrist import WristParameters
from wristctl.simulation.oscillation import LIMIT_CYCLE, at_rest, chatter
from wristctl.simulation.repetitions import Repeated

if TYPE_CHECKING:
    import pandas as pd

# Seed stream of the resampling: the same rows give the same intervals.
_STREAM = 20_041
# Inverses in order of preference for judging a class: control is judged by itself, and a network's error by `train`.
_INVERSES = ("none", "closed-form", "network")


@dataclass(frozen=True)
class ClassStanding:
    """Rows over the cells of one class: every loop, motion and direction of it; or over the worlds of a family."""

    name: str
    """Name of the class; with `, steps` where the motions are jumps."""
    cells: str
    """Number and kind of the cells in which rows are compared: 8 motions, 30 repetitions, 60 worlds."""
    labels: list[str]
    """controller/gains of each row."""
    loops: list[str]
    """Names of the loops that they are on."""
    scores: Array
    """RMSE [rad] over W motions, repetitions or worlds, (R, W); inf where the row failed."""
    standing: Standing
    means: list[GeometricMean]
    """Geometric mean of each row's RMSE [rad]; a failure counts as 90 deg."""
    swing: Array
    """Half of the largest swing at rest [rad], (R,); 0 where all rest."""
    peak: Array
    """Largest tension of a row that is above what a tendon bears [N], (R,); 0 elsewhere."""
    away: NDArray[np.int_]
    """In how many motions each row stays within its range and does not arrive, (R,)."""
    motions: int
    """Number of motions."""
    chatter: Array
    """Largest rate at which a chattering row's tensions go from limit to limit and back, (R,) [1/s]; else 0."""
    unsound: dict[str, NDArray[np.int_]]
    """In how many of the W each row, where it does not fail, is in a limit cycle, chatters, or has not converged, (R,)
    each."""
    jumps: bool = False
    """Whether they are steps."""

    def of(self, results: Sequence[ComparedRow]) -> list[ComparedRow]:
        """Rows of a comparison in this class with its kind of motion."""
        return [result for result in results if result.loop in self.loops and result.jumps == self.jumps]

    def best(self, controller: str) -> int | None:
        """The best row of a controller; None where it has none."""
        return next((row for row in self.standing.order if self.labels[row].split("/")[0] == controller), None)

    def times_better(self, row: int, reference_row: int) -> GeometricMean:
        """Ratio of a reference row's RMSE to another row's in the same cells."""
        penalised_scores = penalised(self.scores)
        return paired_ratio(penalised_scores[reference_row], penalised_scores[row], _STREAM)


def class_standings(
    results: Sequence[ComparedRow], settings: CompareSettings, wrist: WristParameters
) -> list[ClassStanding]:
    """The rows of a comparison in each class of conditions that it has, in the order of CLASSES, steps last."""
    through = next(inverse for inverse in _INVERSES if any(result.inverse == inverse for result in results))
    classes = {name: class_of(loop, wrist) for name, loop in settings.loops.items()}
    compared = [result for result in results if result.inverse == through]
    standings = []
    for jumps in (False, True):
        for name in CLASSES:
            if in_class := [result for result in compared if classes[result.loop] == name and result.jumps == jumps]:
                standings.append(_standing(f"{name}, steps" if jumps else name, in_class, jumps))
    return standings


def _standing(name: str, results: Sequence[ComparedRow], jumps: bool) -> ClassStanding:
    """Rows of one class; over its motions, or over repetitions where all motions have more of them."""
    cells = list(dict.fromkeys((result.loop, result.reference) for result in results))
    repeated = {(result.label, result.loop, result.reference): result.repeated for result in results}
    everyone = dict.fromkeys(result.label for result in results)  # plain Python is left out of the fastest loops
    labels = [label for label in everyone if all((label, *cell) in repeated for cell in cells)]
    table = [[repeated[label, *cell] for cell in cells] for label in labels]
    repetitions = {len(cell.failed) for row in table for cell in row}
    redrawn = len(repetitions) == 1 and max(repetitions) > len(cells)
    logs = [[np.log(_rmse(cell)) for cell in row] for row in table]
    scores = np.exp([np.mean(row, axis=0) if redrawn else [log_rmse.mean() for log_rmse in row] for row in logs])
    ripples = [[_ripple(cell) for cell in row] for row in table]
    ripple = np.array([np.max(row, axis=0) if redrawn else [values.max() for values in row] for row in ripples])
    tensions = [[_chatter(cell) for cell in row] for row in table]
    slams = np.array([np.max(row, axis=0) if redrawn else [values.max() for values in row] for row in tensions])
    drift = [[cell.metrics.get("drift", np.zeros(len(cell.failed))) for cell in row] for row in table]
    drifts = np.array([np.max(row, axis=0) if redrawn else [values.max() for values in row] for row in drift]) > 0.0
    unsound: dict[str, NDArray[np.bool_]] = {
        "limit cycle": ripple > 0.0,
        "chatters": slams > 0.0,
        "not converged": drifts,
    }
    away = np.array([sum(not cell.arrives and not cell.failed.any() for cell in row) for row in table])
    peak = np.array([max(cell.beyond for cell in row) for row in table])
    unit = "repetition" if redrawn else "motion"
    return ClassStanding(
        name, f"{scores.shape[1]} {unit}{'s' * (scores.shape[1] > 1)}", labels,
        list(dict.fromkeys(loop for loop, _ in cells)), scores,
        standing(scores, np.any(list(unsound.values()), axis=0), _STREAM, short=away > 0, unphysical=peak > 0.0),
        [geometric_mean(row_scores, _STREAM) for row_scores in penalised(scores)],
        ripple.max(axis=1), peak, away, len(cells), slams.max(axis=1), _counted(unsound, scores), jumps,
    )  # fmt: skip


def _rmse(repeated: Repeated) -> Array:
    """RMSE of each repetition [rad], inf where it failed. What nobody can measure is no better than the least."""
    rmse = np.maximum(repeated.metrics["rmse"], MEASURABLE)
    return np.where(repeated.failed | ~np.isfinite(rmse), np.inf, rmse)


def _ripple(repeated: Repeated) -> Array:
    """Half of each repetition's swing at rest, where it is a limit cycle [rad]; else 0."""
    oscillation = repeated.metrics.get("oscillation", np.zeros(len(repeated.failed)))
    return np.where((oscillation > LIMIT_CYCLE) & at_rest(repeated.first.trajectory), oscillation, 0.0)


def _chatter(repeated: Repeated) -> Array:
    """Rate at which a chattering repetition's tensions go from limit to limit and back [1/s]; else 0."""
    return chatter(repeated.metrics.get("chattering", np.zeros(len(repeated.failed))), repeated.tension_range)


def _counted(unsound: dict[str, NDArray[np.bool_]], scores: Array) -> dict[str, NDArray[np.int_]]:
    """Number of cells (R,) in which a flag (R, W) holds and the row does not fail."""
    return {name: (holds & np.isfinite(scores)).sum(axis=1) for name, holds in unsound.items()}


def of_ranking(ranking: WorldRanking) -> ClassStanding:
    """Standing of a class from a ranking over worlds."""
    every, none = [row.measured for row in ranking.rows], np.zeros(len(ranking.rows))
    swings, slams = (
        [measured.metrics["oscillation"] * measured.limit_cycles for measured in every],
        [measured.chatter for measured in every],
    )
    cases = {
        "limit cycle": [measured.limit_cycles for measured in every],
        "chatters": [slam > 0.0 for slam in slams],
        "not converged": [measured.unconverged for measured in every],
    }
    shape = len(every), ranking.worlds, -1
    worlds = {name: np.asarray(np.reshape(flags, shape).any(axis=2)) for name, flags in cases.items()}
    scores = np.array([row.rmse for row in ranking.rows])
    return ClassStanding(
        ranking.name, f"{ranking.worlds} worlds", [row.label for row in ranking.rows], [],
        scores, ranking.standing, ranking.means, np.array([np.nanmax(swing, initial=0.0) for swing in swings]),
        none, none.astype(int), ranking.motions, np.array([slam.max(initial=0.0) for slam in slams]),
        _counted(worlds, scores), ranking.jumps,
    )  # fmt: skip


def standings_frame(standings: Sequence[ClassStanding]) -> pd.DataFrame:
    """A row for each row of each class, in order: its group, what becomes of it, its mean, and how often it is lost."""
    import pandas as pd

    lines = []
    for class_standing in standings:
        stands = class_standing.standing
        for row in stands.order:
            mean, lost = class_standing.means[row], stands.lost[row]
            lines.append(
                {
                    "class": class_standing.name,
                    "row": class_standing.labels[row],
                    "group": stands.group(row),
                    "fate": stands.fate(row),
                    "rmse": mean.value,
                    "rmse_low": mean.low,
                    "rmse_high": mean.high,
                    "pairs": lost.n,
                    "fails": stands.failures[row].times,
                    "swings": stands.swings[row].times,
                    "lost_low": lost.low,
                    "lost_high": lost.high,
                    "motions": class_standing.motions,
                    "does_not_arrive": int(class_standing.away[row]),
                    "swing": class_standing.swing[row],
                    "chatter": class_standing.chatter[row],
                    "peak": class_standing.peak[row],
                }
            )
    return pd.DataFrame(lines)
