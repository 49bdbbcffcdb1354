"""Sums over a rollout, tick by tick, for its metrics.

e is the bend less its reference (E12) in each of P planes, |e| its norm over them, sampled at the control ticks. The
move is the time until the reference rests. Tensions are those that act, of one tendon of each of T places.
"""

from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.functions import maximum, norm
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.simulation.motion import GOALS, Goals

# Running sums of a lane: those that metrics are made of, and the integration steps' estimated errors [rad]. Behind them
# are the tensions of the last tick, of as many places as there are, and in two planes OF_BENDS.
SUMS = (
    "squared", "squared_move", "squared_exit", "absolute", "late", "late_count", "exit_2", "exit_5", "overshoot",
    "peak", "squared_tension", "variation", "saturated", "slack", "ticks", "ticks_move", "alive", "until",
    "step_error", "limited",
)  # fmt: skip
OF_BENDS = ("squared_ulnar", "squared_flexion", "squared_most")
(
    _SQUARED, _SQUARED_MOVE, _SQUARED_EXIT, _ABSOLUTE, _LATE, _LATE_COUNT, _EXIT_2, _EXIT_5, _OVERSHOOT,
    _PEAK, _SQUARED_TENSION, _VARIATION, _SATURATED, _SLACK, _TICKS, _TICKS_MOVE, _ALIVE, _UNTIL,
    _STEP_ERROR, _LIMITED,
) = range(len(SUMS))  # fmt: skip
_LAST = len(SUMS)
_MOVE, _BEGIN, _REST, _HORIZON = range(len(GOALS))


def no_sums(planes: int, places: int) -> Array:
    """Sums of a lane that is alive, before its first tick."""
    sums = np.zeros(_LAST + places + (len(OF_BENDS) if planes > 1 else 0))
    sums[_ALIVE] = 1.0
    return sums


def sums_by_name(rows: Array, places: int) -> dict[str, Array]:
    """Sums by name (count,) of rows (count, sums) as the kernel has them."""
    own = rows[:, _LAST + places :]
    return dict(zip(SUMS, rows.T, strict=False)) | dict(zip(OF_BENDS, own.T, strict=False))


@compiled
def gather(sums: Any, goals: Any, time: Any, bend: Any, wish: Any, tensions: Any, saturated: Any, limited: Any) -> None:
    """Add one tick: bends and their reference at `time` (P rows each), the tensions [N] that act then (T rows), 1 where
    the torque was out of reach, and 1 where motors withheld a part of it. `goals` are rows of Goals."""
    zero = zero_like(time)
    planes, count = len(bend), len(tensions)
    of_motion = beyond(goals, 2 * planes)
    moving = where(time <= of_motion[_REST], 1.0, 0.0)
    late = where(time >= 0.9 * of_motion[_HORIZON], 1.0, 0.0)
    move = of_motion[_MOVE]
    squared, passed, errors, apart = zero, zero, lanes_like(bend), lanes_like(bend)
    for p in range(planes):
        errors[p], apart[p] = bend[p] - wish[p], bend[p] - goals[p]
        sums[_SQUARED] = sums[_SQUARED] + errors[p] * errors[p]
        squared = squared + errors[p] * errors[p]
        passed = passed + goals[planes + p] * apart[p]
    error, size = norm(errors), norm(apart)
    sums[_SQUARED_MOVE] = sums[_SQUARED_MOVE] + moving * squared
    sums[_ABSOLUTE] = sums[_ABSOLUTE] + error
    sums[_LATE] = sums[_LATE] + late * error
    sums[_LATE_COUNT] = sums[_LATE_COUNT] + late
    outside = size > 0.02 * move
    sums[_EXIT_2] = where(outside, time, sums[_EXIT_2])
    sums[_SQUARED_EXIT] = where(outside, sums[_SQUARED], sums[_SQUARED_EXIT])
    sums[_EXIT_5] = where(size > 0.05 * move, time, sums[_EXIT_5])
    sums[_OVERSHOOT] = maximum(sums[_OVERSHOOT], where(time >= of_motion[_BEGIN], passed, 0.0))
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
    sums[_LIMITED] = sums[_LIMITED] + limited
    sums[_SLACK] = sums[_SLACK] + where(least <= 0.0, 1.0, 0.0)
    sums[_TICKS] = sums[_TICKS] + 1.0
    sums[_TICKS_MOVE] = sums[_TICKS_MOVE] + moving
    if planes > 1:
        own = beyond(sums, _LAST + count)
        for p in range(planes):
            own[p] = own[p] + errors[p] * errors[p]
        own[planes] = maximum(own[planes], squared)


@compiled
def watch_range(sums: Any, time: Any, bend: Any, reach: Any) -> None:
    """A lane that bends (P rows) beyond `reach` [rad], or to no number, has failed; until when it had not."""
    alive = sums[_ALIVE]
    sums[_UNTIL] = where(alive > 0.0, time, sums[_UNTIL])
    sums[_ALIVE] = where(norm(bend) < reach, alive, 0.0)


@kernel
def _replay(series: Any, goals: Any, sums: Any, period: float, planes: Any, places: Any) -> None:
    goal, total, count = rows_of(goals), rows_of(sums), len(planes)
    for tick in range(series.shape[0]):
        row = rows_of(series[tick])
        bend, wish, tensions = part(row, 0, planes), part(row, count, planes), part(row, 2 * count, places)
        saturated = row[2 * count + len(places)]
        zero = zero_like(saturated)
        gather(total, goal, tick * period + zero, bend, wish, tensions, saturated, zero)


def sums_of(
    period: float, bend: Array, wish: Array, tension: Array, saturated: Array, goals: Goals
) -> dict[str, Array]:
    """The sums by name, (1,) each, of a recorded series sampled every `period` [s].

    It has bends and their reference (K, P) [rad], the tension of one tendon of each place (K, T) [N], and 1 where the
    torque was out of reach (K,). What its motors withheld is not known.
    """
    planes, places = bend.shape[1], tension.shape[1]
    sums = no_sums(planes, places)
    sums[_LIMITED] = np.nan
    series = np.column_stack([bend, wish, tension, saturated]).astype(np.float64)
    _replay(np.ascontiguousarray(series), goals.rows, sums, period, (0,) * planes, (0,) * places)
    return sums_by_name(sums[None], places)
