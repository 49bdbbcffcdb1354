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
from wristctl.comparison.combinations import CLASSES, ComparedRow, class_of
from wristctl.comparison.geometric_means import (
    MEASURABLE,
    GeometricMean,
    geometric_mean,
    paired_ratio,
    penalised,
)  # fmt: skip
from wristctl.comparison.tie_groups import Standing, standing
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.config.controllers import CompareSettings
from wristctl.config.wrist import WristParameters
from wristctl.simulation.oscillation import LIMIT_CYCLE, at_rest, chatter
from wristctl.simulation.repetitions import Repeated

if TYPE_CHECKING:
    import pandas as pd

_STREAM = 20_041
"""Of the resampling: the same rows give the same intervals."""
_INVERSES = ("none", "closed-form", "network")
"""Which of several a class is judged through: control is judged by itself, and a network's error by `train`."""


@dataclass(frozen=True)
class ClassStanding:
    """Rows over the cells of one class: every loop, motion and direction of it; or over the worlds of a family."""

    name: str
    """Of the class; with `, steps` where the motions are jumps."""
    cells: str
    """What rows are compared over, counted: 8 motions, 30 repetitions, 60 worlds."""
    labels: list[str]
    """controller/gains of each row."""
    loops: list[str]
    """Names of the loops that they are on."""
    scores: Array
    """RMSE [rad] over W motions, repetitions or worlds, (R, W); inf where the row failed."""
    standing: Standing
    means: list[GeometricMean]
    """Of each row's RMSE [rad]; a failure counts as 90 deg."""
    swing: Array
    """Half of the largest swing at rest [rad], (R,); 0 where all rest."""
    peak: Array
    """Largest tension of a row that is above what a tendon bears [N], (R,); 0 elsewhere."""
    away: NDArray[np.int_]
    """In how many motions each row stays within its range and does not arrive, (R,)."""
    motions: int
    """How many motions there are."""
    chatter: Array
    """How often a row's tensions go from limit to limit and back where it chatters, at most, (R,) [1/s]; else 0."""
    unsound: dict[str, NDArray[np.int_]]
    """In how many of the W each row, where it does not fail, is in a limit cycle, chatters, or has not converged, (R,)
    each."""
    jumps: bool = False
    """Whether they are steps."""

    def of(self, results: Sequence[ComparedRow]) -> list[ComparedRow]:
        """Those of a comparison's rows that are in this class and of its kind of motion."""
        return [each for each in results if each.loop in self.loops and each.jumps == self.jumps]

    def best(self, controller: str) -> int | None:
        """The best row of a controller; None where it has none."""
        return next((row for row in self.standing.order if self.labels[row].split("/")[0] == controller), None)

    def times_better(self, row: int, other: int) -> GeometricMean:
        """How many times less one row's RMSE is than another's in the same cells."""
        known = penalised(self.scores)
        return paired_ratio(known[other], known[row], _STREAM)


def class_standings(
    results: Sequence[ComparedRow], settings: CompareSettings, wrist: WristParameters
) -> list[ClassStanding]:
    """The rows of a comparison in each class of conditions that it has, in the order of CLASSES, steps last."""
    through = next(each for each in _INVERSES if any(result.inverse == each for result in results))
    classes = {name: class_of(loop, wrist) for name, loop in settings.loops.items()}
    own = [result for result in results if result.inverse == through]
    found = []
    for jumps in (False, True):
        for name in CLASSES:
            if here := [result for result in own if classes[result.loop] == name and result.jumps == jumps]:
                found.append(_standing(f"{name}, steps" if jumps else name, here, jumps))
    return found


def _standing(name: str, results: Sequence[ComparedRow], jumps: bool) -> ClassStanding:
    """Rows of one class; over its motions, or over repetitions where all motions have more of them."""
    labels = list(dict.fromkeys(result.label for result in results))
    cells = list(dict.fromkeys((result.loop, result.reference) for result in results))
    at = {(each.label, each.loop, each.reference): each.repeated for each in results}
    table = [[at[label, *cell] for cell in cells] for label in labels]
    repetitions = {len(each.failed) for row in table for each in row}
    redrawn = len(repetitions) == 1 and max(repetitions) > len(cells)
    logs = [[np.log(_rmse(each)) for each in row] for row in table]
    scores = np.exp([np.mean(row, axis=0) if redrawn else [each.mean() for each in row] for row in logs])
    ripples = [[_ripple(each) for each in row] for row in table]
    ripple = np.array([np.max(row, axis=0) if redrawn else [each.max() for each in row] for row in ripples])
    tensions = [[_chatter(each) for each in row] for row in table]
    slams = np.array([np.max(row, axis=0) if redrawn else [each.max() for each in row] for row in tensions])
    drift = [[each.metrics.get("drift", np.zeros(len(each.failed))) for each in row] for row in table]
    drifts = np.array([np.max(row, axis=0) if redrawn else [each.max() for each in row] for row in drift]) > 0.0
    unsound: dict[str, NDArray[np.bool_]] = {
        "limit cycle": ripple > 0.0,
        "chatters": slams > 0.0,
        "not converged": drifts,
    }
    away = np.array([sum(not each.arrives and not each.failed.any() for each in row) for row in table])
    peak = np.array([max(each.beyond for each in row) for row in table])
    what = "repetition" if redrawn else "motion"
    return ClassStanding(
        name, f"{scores.shape[1]} {what}{'s' * (scores.shape[1] > 1)}", labels,
        list(dict.fromkeys(loop for loop, _ in cells)), scores,
        standing(scores, np.any(list(unsound.values()), axis=0), _STREAM, short=away > 0, unphysical=peak > 0.0),
        [geometric_mean(each, _STREAM) for each in penalised(scores)],
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
    """How often each repetition's tensions go from limit to limit and back, where it chatters [1/s]; else 0."""
    return chatter(repeated.metrics.get("chattering", np.zeros(len(repeated.failed))), repeated.tension_range)


def _counted(unsound: dict[str, NDArray[np.bool_]], scores: Array) -> dict[str, NDArray[np.int_]]:
    """Of what holds (R, W) how often it does where a row does not fail, (R,)."""
    return {name: (holds & np.isfinite(scores)).sum(axis=1) for name, holds in unsound.items()}


def of_ranking(found: WorldRanking) -> ClassStanding:
    """The same of a ranking over worlds."""
    every, none = [row.measured for row in found.rows], np.zeros(len(found.rows))
    swings, slams = (
        [each.metrics["oscillation"] * each.limit_cycles for each in every],
        [each.chatter for each in every],
    )
    cases = {
        "limit cycle": [each.limit_cycles for each in every],
        "chatters": [each > 0.0 for each in slams],
        "not converged": [each.unconverged for each in every],
    }
    shape = len(every), found.worlds, -1
    worlds = {name: np.asarray(np.reshape(each, shape).any(axis=2)) for name, each in cases.items()}
    scores = np.array([row.rmse for row in found.rows])
    return ClassStanding(
        found.name, f"{found.worlds} worlds", [row.label for row in found.rows], [],
        scores, found.standing, found.means, np.array([np.nanmax(each, initial=0.0) for each in swings]),
        none, none.astype(int), found.motions, np.array([each.max(initial=0.0) for each in slams]),
        _counted(worlds, scores), found.jumps,
    )  # fmt: skip


def standings_frame(found: Sequence[ClassStanding]) -> pd.DataFrame:
    """A row for each row of each class, in order: its group, what becomes of it, its mean, and how often it is lost."""
    import pandas as pd

    lines = []
    for each in found:
        stands = each.standing
        for row in stands.order:
            mean, lost = each.means[row], stands.lost[row]
            lines.append(
                {
                    "class": each.name,
                    "row": each.labels[row],
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
                    "motions": each.motions,
                    "does_not_arrive": int(each.away[row]),
                    "swing": each.swing[row],
                    "chatter": each.chatter[row],
                    "peak": each.peak[row],
                }
            )
    return pd.DataFrame(lines)
