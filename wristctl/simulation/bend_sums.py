"""Sums over a rollout in two planes, sample by sample, for its metrics.

e is the bend less its reference in each plane, |e| its size over both. Commanded pulls and pulls as they act are those
at each place of tendons.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import dot, sqrt, where, zero_like
from wristctl.simulation.bend_course import FULL

# Running sums of a lane; the commanded pulls of the last sample follow.
BEND_SUMS = (
    "squared_ulnar", "squared_flexion", "squared_most", "late", "squared_tip", "peak", "variation", "saturated",
    "slack", "alive", "until",
)  # fmt: skip
(
    _SQUARED_ULNAR, _SQUARED_FLEXION, _SQUARED_MOST, _LATE, _SQUARED_TIP, _PEAK, _VARIATION, _SATURATED,
    _SLACK, _ALIVE, _UNTIL,
) = range(len(BEND_SUMS))  # fmt: skip
_COUNT = len(BEND_SUMS)


class Errors(NamedTuple):
    """e of each plane [rad], and from the tip of one arc that is bent as wanted to the true one (space) [m]."""

    ulnar: Any
    flexion: Any
    tip: Any


class BendGoals(NamedTuple):
    """Number of samples in the last part of the horizon, and in all."""

    late: int
    samples: int


@compiled
def watch_bends(sums: Any, time: Any, alive: Any) -> None:
    """Note at a sample whether the wrist is within its range, and until when it was."""
    sums[_ALIVE] = alive
    sums[_UNTIL] = where(alive > 0.0, time, sums[_UNTIL])


@compiled
def gather_bends(sums: Any, sample: int, late: float, errors: Any, pulls: Any, acting: Any, share: Any) -> None:
    """Add one sample; `late` is 1 in the last part of the horizon, else 0, `share` what of the torque is reached."""
    zero = zero_like(share)
    squared_ulnar, squared_flexion = errors.ulnar * errors.ulnar, errors.flexion * errors.flexion
    squared = squared_ulnar + squared_flexion
    sums[_SQUARED_ULNAR] = sums[_SQUARED_ULNAR] + squared_ulnar
    sums[_SQUARED_FLEXION] = sums[_SQUARED_FLEXION] + squared_flexion
    sums[_SQUARED_MOST] = maximum(sums[_SQUARED_MOST], squared)
    sums[_LATE] = sums[_LATE] + late * sqrt(squared)
    sums[_SQUARED_TIP] = sums[_SQUARED_TIP] + dot(errors.tip, errors.tip)
    peak, least, change = sums[_PEAK], acting[0], zero
    for t in range(len(pulls)):
        peak = maximum(peak, acting[t])
        least = where(acting[t] < least, acting[t], least)
        change = change + abs(pulls[t] - sums[_COUNT + t])
        sums[_COUNT + t] = pulls[t]
    sums[_PEAK] = peak
    if sample > 0:
        sums[_VARIATION] = sums[_VARIATION] + change
    sums[_SATURATED] = sums[_SATURATED] + where(share < FULL, 1.0, zero)
    sums[_SLACK] = sums[_SLACK] + where(least <= 0.0, 1.0, zero)
