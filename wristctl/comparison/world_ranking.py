"""Rows ranked over the worlds of a family: groups of ties, what each is worth beside feedforward, how often it fails.

All rows meet the same worlds, motions and noise. A row's score in a world is the geometric mean of its RMSE over the
motions there; intervals are over worlds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.geometric_means import GeometricMean, geometric_mean, paired_ratio, penalised
from wristctl.comparison.tie_groups import Standing, standing
from wristctl.config.control import Row
from wristctl.config.families import Family, Worlds
from wristctl.config.study import Study
from wristctl.control.table import TunedGains, controller, gains_of
from wristctl.simulation.cases import Measured, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.tuning.objective import YARDSTICK
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd

RANKED = ("rmse", "steady_state", "oscillation", "chattering", "peak_tension", "rms_tension", "saturation", "energy")
"""Metrics that are kept of every row in every case."""
FAILURE = float(np.deg2rad(90.0))
"""RMSE [rad] that a failure counts as in means; a row that fails stands in no group."""
_STREAM = 20_031
"""Of the resampling: the same worlds give the same intervals."""


class RankedRow(NamedTuple):
    """A row's figures in every world, (W,) each, and all that was measured, (1, W motions)."""

    label: str
    rmse: Array
    """Geometric mean over the motions [rad]; inf where one failed."""
    swings: NDArray[np.bool_]
    """Whether it swings by more than 0.1 deg where any motion rests."""
    measured: Measured


@dataclass(frozen=True)
class WorldRanking:
    """Rows over a family's worlds; `yardstick` is the number of feedforward's."""

    name: str
    family: Family
    worlds: int
    rows: list[RankedRow]
    yardstick: int
    standing: Standing
    means: list[GeometricMean]
    """Of each row's RMSE [rad]."""
    gains: list[GeometricMean]
    """How many times less each row's RMSE is than feedforward's."""

    @property
    def order(self) -> list[int]:
        """Rows from best to worst, those that cannot be relied on last."""
        return [row for group in self.standing.groups for row in group.rows] + self.standing.unreliable

    def group(self, row: int) -> int | None:
        """The number of a row's group, from 1; None where it fails or swings."""
        return next((at for at, each in enumerate(self.standing.groups, start=1) if row in each.rows), None)

    def lost(self, row: int) -> int:
        """Worlds in which a row fails or swings."""
        own = self.rows[row]
        return int(np.sum(~np.isfinite(own.rmse) | own.swings))


def seed_of(study: Study, worlds: Worlds) -> int:
    """What its split is drawn from."""
    return study.seed if worlds.sealed is None else worlds.sealed


def rank(
    study: Study,
    tuned: TunedGains | None = None,
    network: Inverse | None = None,
    progress: Callable[[float], None] | None = None,
) -> WorldRanking:
    """Rank the rows of the study's `compare` section on the worlds that it names; feedforward joins as the yardstick.

    UserError for unknown gains.
    """
    worlds = study.compare.worlds
    family, name = study.families[worlds.family], worlds.family
    cases = drawn_cases(family, name, worlds.split, seed_of(study, worlds), worlds.draws, study.wrist, network)
    rows = list(study.compare.rows)
    if not any(row.controller == YARDSTICK for row in rows):
        rows.append(Row(controller=YARDSTICK, gains="default"))
    ranked = []
    for number, row in enumerate(rows):
        law = controller(row.controller)

        def report(share: float, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(rows))

        gains = np.array([gains_of(law, row.gains, tuned)])
        ranked.append(_row(row.label, measure(law, gains, cases, study.wrist, RANKED, report), worlds.draws))
    return ranking(name, family, ranked, next(k for k, row in enumerate(rows) if row.controller == YARDSTICK))


def _row(label: str, found: Measured, worlds: int) -> RankedRow:
    swings = np.any(found.swings.reshape(worlds, -1), axis=1)
    return RankedRow(label, world_scores(found, worlds)[0], swings, found)


def world_scores(found: Measured, worlds: int) -> Array:
    """Geometric mean of the RMSE [rad] over the motions of each world, (P, worlds); inf where one failed."""
    rmse = np.where(found.failed, np.inf, found.metrics["rmse"])
    scores: Array = np.exp(np.log(rmse).reshape(len(rmse), worlds, -1).mean(axis=2))
    return scores


def ranking(
    name: str, family: Family, rows: Sequence[RankedRow], yardstick: int, tolerated: float = 0.0
) -> WorldRanking:
    """The ranking of rows that were measured on the same worlds, of which each may fail or swing in a share."""
    scores = np.array([row.rmse for row in rows])
    known = penalised(scores, FAILURE)
    stands = standing(scores, np.array([row.swings for row in rows]), FAILURE, _STREAM, tolerated)
    means = [geometric_mean(each, _STREAM) for each in known]
    gains = [paired_ratio(known[yardstick], each, _STREAM) for each in known]
    return WorldRanking(name, family, scores.shape[1], list(rows), yardstick, stands, means, gains)


def ranking_frame(found: WorldRanking) -> pd.DataFrame:
    """A row for each, from best to worst, with intervals; angles in rad."""
    import pandas as pd

    lines = []
    for at in found.order:
        row, mean, gain = found.rows[at], found.means[at], found.gains[at]
        failures, swings = found.standing.failures[at], found.standing.swings[at]
        lines.append(
            {
                "row": row.label,
                "group": found.group(at),
                "rmse": mean.value,
                "rmse_low": mean.low,
                "rmse_high": mean.high,
                "times_better": gain.value,
                "times_better_low": gain.low,
                "times_better_high": gain.high,
                "worst_rmse": row.rmse.max(),
                "failures": failures.value,
                "failures_high": failures.high,
                "swings": swings.value,
                "swings_high": swings.high,
            }
            | {name: _median(row.measured.metrics[name]) for name in RANKED[1:]}
        )
    return pd.DataFrame(lines)


def _median(values: Array) -> float:
    """Of what there is; nan where there is nothing."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.nan


def worlds_frame(found: WorldRanking) -> pd.DataFrame:
    """Every row in every world and motion."""
    import pandas as pd

    parts = []
    for row in found.rows:
        count = row.measured.failed.shape[1]
        motions = count // found.worlds
        where = {"row": row.label, "world": np.arange(count) // motions, "motion": np.arange(count) % motions}
        values = {name: values[0] for name, values in row.measured.metrics.items()}
        parts.append(pd.DataFrame(where | {"failed": row.measured.failed[0]} | values))
    return pd.concat(parts, ignore_index=True)
