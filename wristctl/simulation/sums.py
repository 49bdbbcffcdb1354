"""Sums over a rollout, tick by tick, for its metrics.

e = theta - theta_ref (E12), sampled at the control ticks. The move is the time until the reference rests. Tensions are
those that act, of one tendon of each side.
"""

from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import rows_named, rows_of
from wristctl.simulation.motion import Goals

# Running sums of a lane: those that metrics are made of, and the integration steps' estimated errors [rad].
SUMS = (
    "squared", "squared_move", "squared_exit", "absolute", "late", "late_count", "exit_2", "exit_5", "overshoot",
    "peak", "squared_tension", "variation", "saturated", "slack", "ticks", "ticks_move", "plus", "minus", "alive",
    "until", "step_error",
)  # fmt: skip

goals_of = rows_named(Goals._fields)
(
    _SQUARED, _SQUARED_MOVE, _SQUARED_EXIT, _ABSOLUTE, _LATE, _LATE_COUNT, _EXIT_2, _EXIT_5, _OVERSHOOT,
    _PEAK, _SQUARED_TENSION, _VARIATION, _SATURATED, _SLACK, _TICKS, _TICKS_MOVE, _PLUS, _MINUS, _ALIVE,
    _UNTIL, _STEP_ERROR,
) = range(len(SUMS))  # fmt: skip


@compiled
def gather(sums: Any, goals: Any, time: Any, theta: Any, theta_ref: Any, plus: Any, minus: Any, saturated: Any) -> None:
    """Add one tick: the error at `time`, the tensions [N] commanded then, and 1 where the torque was out of reach."""
    error = theta - theta_ref
    squared = error * error
    size = abs(theta - goals.final)
    moving = where(time <= goals.rest, 1.0, 0.0)
    late = where(time >= 0.9 * goals.horizon, 1.0, 0.0)
    sums[_SQUARED] = sums[_SQUARED] + squared
    sums[_SQUARED_MOVE] = sums[_SQUARED_MOVE] + moving * squared
    sums[_ABSOLUTE] = sums[_ABSOLUTE] + abs(error)
    sums[_LATE] = sums[_LATE] + late * abs(error)
    sums[_LATE_COUNT] = sums[_LATE_COUNT] + late
    move = abs(goals.move)
    outside = size > 0.02 * move
    sums[_EXIT_2] = where(outside, time, sums[_EXIT_2])
    sums[_SQUARED_EXIT] = where(outside, sums[_SQUARED], sums[_SQUARED_EXIT])
    sums[_EXIT_5] = where(size > 0.05 * move, time, sums[_EXIT_5])
    passed = where(goals.move < 0.0, goals.final - theta, theta - goals.final)
    sums[_OVERSHOOT] = maximum(sums[_OVERSHOOT], where(time >= goals.begin, passed, 0.0))
    sums[_PEAK] = maximum(sums[_PEAK], maximum(plus, minus))
    sums[_SQUARED_TENSION] = sums[_SQUARED_TENSION] + 0.5 * (plus * plus + minus * minus)
    change = abs(plus - sums[_PLUS]) + abs(minus - sums[_MINUS])
    sums[_VARIATION] = sums[_VARIATION] + where(sums[_TICKS] > 0.0, change, 0.0)
    sums[_PLUS] = plus
    sums[_MINUS] = minus
    sums[_SATURATED] = sums[_SATURATED] + saturated
    sums[_SLACK] = sums[_SLACK] + where((plus <= 0.0) | (minus <= 0.0), 1.0, 0.0)
    sums[_TICKS] = sums[_TICKS] + 1.0
    sums[_TICKS_MOVE] = sums[_TICKS_MOVE] + moving


@compiled
def watch_range(sums: Any, time: Any, theta: Any, reach: Any) -> None:
    """A lane that bends beyond `reach` [rad], or to no number, has failed; until when it had not."""
    alive = sums[_ALIVE]
    sums[_UNTIL] = where(alive > 0.0, time, sums[_UNTIL])
    sums[_ALIVE] = where(abs(theta) < reach, alive, 0.0)


@kernel
def _replay(series: Any, goals: Any, sums: Any, period: float) -> None:
    goal = goals_of(goals)
    total = rows_of(sums)
    for tick in range(series.shape[0]):
        row = rows_of(series[tick])
        gather(total, goal, tick * period + zero_like(row[0]), row[0], row[1], row[2], row[3], row[4])


def sums_of(period: float, series: Array, goals: Goals) -> Array:
    """The sums (SUMS,) of a recorded series (T, 5) sampled every `period` [s].

    Its columns are angle and reference [rad], tension of both sides [N], and 1 where the torque was out of reach.
    """
    sums = np.zeros(len(SUMS))
    sums[_ALIVE] = 1.0
    _replay(np.ascontiguousarray(series), np.array(goals), sums, period)
    return sums
