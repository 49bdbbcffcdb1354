"""How much of a motion's range a wrist really follows: of daily living, where its two degrees are what hands notice."""

import numpy as np

from wristctl.simulation.metrics import Metric
from wristctl.simulation.trajectory import Trajectory

WITHIN = np.deg2rad(2.0)
BIN = np.deg2rad(1.0)


def range_untracked(course: Trajectory) -> float:
    """Share of the wanted range in which the angle was ever off by more than 2 deg, by bins of 1 deg.

    Bins that a motion jumps over are no part of its range.
    """
    wanted = course.theta_desired
    bins = np.floor((wanted - wanted.min()) / BIN + 1e-9).astype(np.int64)
    worst = np.zeros(bins.max() + 1)
    np.maximum.at(worst, bins, np.nan_to_num(np.abs(course.theta - wanted), nan=np.inf))
    return float(np.mean(worst[np.unique(bins)] > WITHIN))


RANGE_UNTRACKED = Metric(
    "",
    "share of the wanted range, in bins of 1 deg, in which the angle was ever off by more than 2 deg",
    of_trajectory=range_untracked,
    floor=0.01,
)
