"""Where spools were between the counts that a board told: when it counted, and how it turned on from there.

A host knows to half a millisecond when the board read its counters: a frame of USB and the steps' interrupts come
before. The board's own clock, which stands in each answer, says when they were read one after the other. Between two
counts a spool turns by the step rates that the host has sent, as `wristctl.simulation.spool_timing` has it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Polynomial

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import rows_of
from wristctl.simulation.simulated_drives import read_timing
from wristctl.simulation.spool_timing import rate_after, timing_of, way
from wristctl.wrist.directions import ACTIVE

if TYPE_CHECKING:
    import pandas as pd

# Time between the board's readings of one axis and the next, by the firmware's cycles [s].
_NEXT_AXIS = 2.5e-5
# Time on which the board's clock begins anew [s].
_CLOCK_WRAPS = 2.0**32 * 1e-6
# Ticks of which no more are not enough to compare the clocks.
_FEW = 20
# Medians of the absolute deviation beyond which the host's reckoning of a count's time says nothing of the clocks.
_OUTLYING = 4.0

SpoolPaths = Callable[[Array], Array]
"""Microsteps (T, 4) that the spools of tendons 1, 2, 4 and 5 have reeled in at times (T,) [s]."""


def answered(log: pd.DataFrame) -> pd.DataFrame:
    """The ticks of a log by which the board had answered anew: until then its last positions stand there again."""
    return log.drop_duplicates("counted")


def has_rates(log: pd.DataFrame) -> bool:
    """Whether a log is of the motor board's four axes, and has the step rates that were sent."""
    return {f"sent_{tendon}" for tendon in ACTIVE} == {name for name in log.columns if name.startswith("sent_")}


def count_times(ticks: pd.DataFrame) -> Array:
    """Times (T, 4) [s] at which the board counted the steps of each axis, of ticks by which it had answered anew.

    They are on the trial's time. The rates of both clocks need not be the same.
    """
    reckoned, axes = ticks.counted.to_numpy(float), np.arange(len(ACTIVE))
    if "board" not in ticks or len(ticks) <= _FEW:
        return np.repeat(reckoned[:, None], len(axes), axis=1)
    board = np.unwrap(ticks.board.to_numpy(float), period=_CLOCK_WRAPS)
    away = np.abs(reckoned - Polynomial.fit(board, reckoned, 1)(board))
    usual = away <= _OUTLYING * np.median(away)
    of_board = Polynomial.fit(board[usual], reckoned[usual], 1)(board)
    times: Array = of_board[:, None] + _NEXT_AXIS * (axes - axes.mean())
    return times


def spool_paths(log: pd.DataFrame, motors: Actuator) -> SpoolPaths:
    """Paths of the spools in one trial of a log, through all that the board counted.

    `motors` are as believed: of these is the ramp. In a log without the step rates that were sent, paths are smooth.
    """
    ticks = answered(log)
    times, counts = count_times(ticks), ticks[[f"position_{tendon}" for tendon in ACTIVE]].to_numpy(float)
    if not has_rates(log):
        from scipy.interpolate import CubicSpline

        splines = [CubicSpline(*column) for column in zip(times.T, counts.T, strict=True)]
        return lambda instants: np.stack([spline(instants) for spline in splines], axis=1)
    sent = [f"sent_{tendon}" for tendon in ACTIVE]
    changes = _read(log.time.to_numpy(float), times.mean(axis=1), motors) + 0.5 * motors.update
    drive = _Drive(motors, changes, np.nan_to_num(log[sent].to_numpy(float)))
    reckoned = np.stack([drive.at(of_axis)[:, axis] for axis, of_axis in enumerate(times.T)], axis=1)

    def paths(instants: Array) -> Array:
        off = [np.interp(instants, *column) for column in zip(times.T, (counts - reckoned).T, strict=True)]
        path: Array = drive.at(instants) + np.stack(off, axis=1)
        return path

    return paths


def _read(begun: Array, counted: Array, motors: Actuator) -> Array:
    """Times [s] at which the board has read the step rates of ticks that begin then: when it counted, if it told."""
    believed = begun + motors.command_delay
    after = np.clip(np.searchsorted(counted, believed), 1, len(counted) - 1)
    nearest = np.where(believed - counted[after - 1] < counted[after] - believed, after - 1, after)
    close = np.abs(counted[nearest] - believed) < 0.5 * float(np.median(np.diff(begun)))
    read: Array = np.where(close, counted[nearest], believed)
    return read


class _Drive:
    """Spools that begin at rest at zero, and turn at `rates` (K, 4) [1/s] that axes take up at `changes` (K,) [s]."""

    def __init__(self, motors: Actuator, changes: Array, rates: Array) -> None:
        self._timing, self._changes, self._rates = np.array(timing_of(motors)), changes, np.ascontiguousarray(rates)

    def at(self, times: Array) -> Array:
        """Microsteps (T, 4) at times (T,) [s] in any order."""
        order = np.argsort(times, kind="stable")
        sorted_places = np.empty((len(times), self._rates.shape[1]))
        begin = np.zeros((2, self._rates.shape[1]))
        _follow(self._timing, self._changes, self._rates, times[order], begin[0], begin[1], sorted_places)
        places = np.empty_like(sorted_places)
        places[order] = sorted_places
        return places


@kernel
def _follow(timing: Any, changes: Any, rates: Any, times: Any, place: Any, moving: Any, out: Any) -> None:
    board, places, speeds = read_timing(rows_of(timing)), rows_of(place), rows_of(moving)
    change = 0
    for sample in range(len(times)):
        while change + 1 < len(changes) and changes[change + 1] <= times[sample]:
            after = rows_of(rates[change])
            for axis in range(len(place)):
                lasted = changes[change + 1] - changes[change] + zero_like(places[axis])
                places[axis] = places[axis] + way(board, speeds[axis], after[axis], lasted)
                speeds[axis] = rate_after(board, speeds[axis], after[axis], lasted)
            change += 1
        after, path = rows_of(rates[change]), rows_of(out[sample])
        for axis in range(len(place)):
            since = times[sample] - changes[change] + zero_like(places[axis])
            path[axis] = places[axis] + way(board, speeds[axis], after[axis], since)
