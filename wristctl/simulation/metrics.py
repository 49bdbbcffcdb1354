"""Metrics of one rollout, gathered tick by tick, each with formula, unit and direction.

e = theta - theta_ref (E12), sampled at the control ticks; T is the horizon. The move is the time until the reference
rests; a reference that does not rest before the horizon has neither settling time nor overshoot. Tensions are those
that act, of one tendon of each side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where
from wristctl.lanes.rows import rows_named, rows_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """What a number means; of all of them less is better."""

    unit: str
    formula: str


METRICS: dict[str, Metric] = {
    "rmse": Metric("rad", "sqrt(mean e^2) over the horizon"),
    "rmse_move": Metric("rad", "sqrt(mean e^2) until the reference rests; over the horizon for a step"),
    "rmse_settled": Metric("rad", "sqrt(mean e^2) after the settling time (2 %)"),
    "settling": Metric("s", "last instant outside +-2 % of the move around the final reference; never: nan"),
    "settling_5": Metric("s", "the same for +-5 %"),
    "steady_state": Metric("rad", "mean |e| over the last 10 % of the horizon"),
    "overshoot": Metric("%", "largest passing of the final reference over the last move, from that move's beginning"),
    "iae": Metric("rad s", "integral of |e|"),
    "peak_tension": Metric("N", "largest tension of a tendon"),
    "rms_tension": Metric("N", "sqrt(mean of both sides' squared tensions)"),
    "chattering": Metric("N/s", "total variation of both sides' tensions per second"),
    "saturation": Metric("", "share of time in which the wanted torque was out of the tendons' reach"),
    "slack": Metric("", "share of time in which a tendon was slack"),
}

SUMS = (
    "squared", "squared_move", "squared_exit", "absolute", "late", "late_count", "exit_2", "exit_5", "overshoot",
    "peak", "squared_tension", "variation", "saturated", "slack", "ticks", "ticks_move", "plus", "minus", "alive",
)  # fmt: skip
"""Running sums of a lane, from which `summary` makes the metrics."""

GOALS = ("final", "move", "begin", "rest", "horizon")
"""What metrics need of the reference: final angle and last move [rad], when it begins and rests, horizon [s]."""

_LEAST_MOVE = 1e-9
"""Move [rad] below which there is nothing to settle on."""

goals_of = rows_named(GOALS)
(
    _SQUARED, _SQUARED_MOVE, _SQUARED_EXIT, _ABSOLUTE, _LATE, _LATE_COUNT, _EXIT_2, _EXIT_5, _OVERSHOOT,
    _PEAK, _SQUARED_TENSION, _VARIATION, _SATURATED, _SLACK, _TICKS, _TICKS_MOVE, _PLUS, _MINUS, _ALIVE,
) = range(len(SUMS))  # fmt: skip


@compiled
def gather(sums: Any, goals: Any, time: Any, theta: Any, theta_ref: Any, plus: Any, minus: Any, saturated: Any) -> None:
    """Add one tick: the error at `time`, the tensions [N] commanded then, and 1 where the torque was out of reach."""
    error = theta - theta_ref
    squared = error * error
    size = abs(theta - goals.final)
    moving = where(time <= goals.rest, 1.0, 0.0 * time)
    late = where(time >= 0.9 * goals.horizon, 1.0, 0.0 * time)
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
    sums[_OVERSHOOT] = maximum(sums[_OVERSHOOT], where(time >= goals.begin, passed, 0.0 * passed))
    sums[_PEAK] = maximum(sums[_PEAK], maximum(plus, minus))
    sums[_SQUARED_TENSION] = sums[_SQUARED_TENSION] + 0.5 * (plus * plus + minus * minus)
    change = abs(plus - sums[_PLUS]) + abs(minus - sums[_MINUS])
    sums[_VARIATION] = sums[_VARIATION] + where(sums[_TICKS] > 0.0, change, 0.0 * change)
    sums[_PLUS] = plus
    sums[_MINUS] = minus
    sums[_SATURATED] = sums[_SATURATED] + saturated
    sums[_SLACK] = sums[_SLACK] + where((plus <= 0.0) | (minus <= 0.0), 1.0, 0.0 * plus)
    sums[_TICKS] = sums[_TICKS] + 1.0
    sums[_TICKS_MOVE] = sums[_TICKS_MOVE] + moving


def summary(sums: Array, goals: Array, period: float) -> dict[str, Array]:
    """Metrics of each lane from rows (count, SUMS) and (count, GOALS); all nan but the tensions where it diverged."""
    of = dict(zip(SUMS, sums.T, strict=True))
    goal = dict(zip(GOALS, goals.T, strict=True))
    ticks = of["ticks"]
    after = np.round(ticks - of["exit_2"] / period) - 1.0
    step = goal["rest"] <= 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        rests = (goal["rest"] < goal["horizon"]) & (np.abs(goal["move"]) > _LEAST_MOVE)
        settled = rests & (of["exit_2"] < goal["horizon"] - 1.5 * period)
        result = {
            "rmse": np.sqrt(of["squared"] / ticks),
            "rmse_move": np.sqrt(np.where(step, of["squared"] / ticks, of["squared_move"] / of["ticks_move"])),
            "rmse_settled": np.where(settled, np.sqrt((of["squared"] - of["squared_exit"]).clip(0.0) / after), np.nan),
            "settling": np.where(settled, of["exit_2"], np.nan),
            "settling_5": np.where(rests & (of["exit_5"] < goal["horizon"] - 1.5 * period), of["exit_5"], np.nan),
            "steady_state": of["late"] / of["late_count"],
            "overshoot": np.where(rests, 100.0 * of["overshoot"] / np.abs(goal["move"]), np.nan),
            "iae": of["absolute"] * period,
        }
    alive = of["alive"] > 0.0
    result = {name: np.where(alive, value, np.nan) for name, value in result.items()}
    result["peak_tension"] = of["peak"]
    result["rms_tension"] = np.sqrt(of["squared_tension"] / ticks)
    result["chattering"] = of["variation"] / goal["horizon"]
    result["saturation"] = of["saturated"] / ticks
    result["slack"] = of["slack"] / ticks
    return result


@compiled
def _replay(series: Any, goals: Any, sums: Any, period: float) -> None:
    goal = goals_of(goals)
    total = rows_of(sums)
    for tick in range(series.shape[0]):
        row = rows_of(series[tick])
        gather(total, goal, tick * period + 0.0 * row[0], row[0], row[1], row[2], row[3], row[4])


def metrics_of(
    period: float,
    theta: Array,
    theta_ref: Array,
    tension: Array,
    final: float,
    rest: float,
    saturated: Array | None = None,
) -> dict[str, float]:
    """Metrics of one recorded series, sampled every `period` [s]: angles (T,) [rad], tensions (T, 2) [N].

    `final` is the final reference angle, reached from 0, and `rest` the time at which the reference rests.
    """
    count = len(theta)
    flags = np.zeros(count) if saturated is None else np.asarray(saturated, float)
    series = np.column_stack([theta, theta_ref, tension, flags])
    goals = np.array([final, final, 0.0, rest, count * period])
    sums = np.zeros(len(SUMS))
    sums[_ALIVE] = 1.0
    _replay(series, goals, sums, period)
    return {name: float(value[0]) for name, value in summary(sums[None], goals[None], period).items()}
