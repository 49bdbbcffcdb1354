"""Sums over a rollout, tick by tick, for its metrics.

e is the bend less its reference (E12) in each of P planes, |e| its norm over them, sampled at the control ticks. The
move is the time until the reference rests. Tensions are those that act, of one tendon of each of T places.
"""

from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.functions import maximum, norm
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_named, rows_of
from wristctl.simulation.motion import Goals

# Running sums of a lane: those that metrics are made of, and the integration steps' estimated errors [rad]; tensions of
# the last tick, of as many places as there are, are behind them.
SUMS = (
    "squared", "squared_move", "squared_exit", "absolute", "late", "late_count", "exit_2", "exit_5", "overshoot",
    "peak", "squared_tension", "variation", "saturated", "slack", "ticks", "ticks_move", "alive", "until",
    "step_error",
)  # fmt: skip


class MoveGoals(NamedTuple):
    """Goals of each lane's motion: rows by the names of Goals."""

    rows: Any


goals_of = rows_named(Goals._fields)
(
    _SQUARED, _SQUARED_MOVE, _SQUARED_EXIT, _ABSOLUTE, _LATE, _LATE_COUNT, _EXIT_2, _EXIT_5, _OVERSHOOT,
    _PEAK, _SQUARED_TENSION, _VARIATION, _SATURATED, _SLACK, _TICKS, _TICKS_MOVE, _ALIVE, _UNTIL,
    _STEP_ERROR,
) = range(len(SUMS))  # fmt: skip


_LAST = len(SUMS)


@compiled
def gather(sums: Any, goals: Any, time: Any, bend: Any, wish: Any, tensions: Any, saturated: Any) -> None:
    """Add one tick: bends and their reference at `time` (P rows each), the tensions [N] that act then (T rows), and 1
    where the torque was out of reach."""
    zero = zero_like(time)
    planes, count = len(bend), len(tensions)
    moving = where(time <= goals.rest, 1.0, 0.0)
    late = where(time >= 0.9 * goals.horizon, 1.0, 0.0)
    move = abs(goals.move)
    squared, passed, errors, apart = zero, zero, lanes_like(bend), lanes_like(bend)
    toward = where(goals.move < 0.0, -1.0, 1.0)
    for p in range(planes):
        errors[p], apart[p] = bend[p] - wish[p], bend[p] - goals.final
        sums[_SQUARED] = sums[_SQUARED] + errors[p] * errors[p]
        squared = squared + errors[p] * errors[p]
        passed = passed + toward * apart[p]
    error, size = norm(errors), norm(apart)
    sums[_SQUARED_MOVE] = sums[_SQUARED_MOVE] + moving * squared
    sums[_ABSOLUTE] = sums[_ABSOLUTE] + error
    sums[_LATE] = sums[_LATE] + late * error
    sums[_LATE_COUNT] = sums[_LATE_COUNT] + late
    outside = size > 0.02 * move
    sums[_EXIT_2] = where(outside, time, sums[_EXIT_2])
    sums[_SQUARED_EXIT] = where(outside, sums[_SQUARED], sums[_SQUARED_EXIT])
    sums[_EXIT_5] = where(size > 0.05 * move, time, sums[_EXIT_5])
    sums[_OVERSHOOT] = maximum(sums[_OVERSHOOT], where(time >= goals.begin, passed, 0.0))
    peak, square, change, least = sums[_PEAK], zero, zero, tensions[0]
    for back in range(count):
        t = count - 1 - back
        tension = tensions[t]
        peak = maximum(peak, tension)
        square = square + tension * tension
        change = change + abs(tension - sums[_LAST + t])
        least = where(tension < least, tension, least)
        sums[_LAST + t] = tension
    sums[_PEAK] = peak
    sums[_SQUARED_TENSION] = sums[_SQUARED_TENSION] + (1.0 / count) * square
    sums[_VARIATION] = sums[_VARIATION] + where(sums[_TICKS] > 0.0, change, 0.0)
    sums[_SATURATED] = sums[_SATURATED] + saturated
    sums[_SLACK] = sums[_SLACK] + where(least <= 0.0, 1.0, 0.0)
    sums[_TICKS] = sums[_TICKS] + 1.0
    sums[_TICKS_MOVE] = sums[_TICKS_MOVE] + moving


@compiled
def watch_range(sums: Any, time: Any, bend: Any, reach: Any) -> None:
    """A lane that bends (P rows) beyond `reach` [rad], or to no number, has failed; until when it had not."""
    alive = sums[_ALIVE]
    sums[_UNTIL] = where(alive > 0.0, time, sums[_UNTIL])
    sums[_ALIVE] = where(norm(bend) < reach, alive, 0.0)


@kernel
def _replay(series: Any, goals: Any, sums: Any, period: float) -> None:
    goal = goals_of(goals)
    total = rows_of(sums)
    for tick in range(series.shape[0]):
        row = rows_of(series[tick])
        bend, wish, tensions = part(row, 0, (0,)), part(row, 1, (0,)), part(row, 2, (0, 0))
        gather(total, goal, tick * period + zero_like(row[0]), bend, wish, tensions, row[4])


def sums_of(period: float, series: Array, goals: Goals) -> Array:
    """The sums of a recorded series (T, 5) sampled every `period` [s].

    Its columns are angle and reference [rad], tension of both sides [N], and 1 where the torque was out of reach.
    """
    sums = np.zeros(len(SUMS) + 2)
    sums[_ALIVE] = 1.0
    _replay(np.ascontiguousarray(series), np.array(goals), sums, period)
    return sums
