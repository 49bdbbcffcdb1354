"""Looks at a log before anything is fitted: what no wrist does is refused with its line, what is mended is told."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from wristctl.errors import UserError
from wristctl.records.open_log import OpenLog

# Bend [rad] and spool [m] beyond any wrist's; steady steps [s] over a time [s] that no recording of a motion has.
_BEND, _SPOOL, _STEP, _LONG = 4.0 * math.pi, 2.0, 5.0, 3600.0
# Way [m] between two samples, and its speed [m/s], that no motor makes.
_JUMP, _SPEED = 0.02, 2.0
# Correlation of bend and pull from which the senses are opposite.
_OPPOSITE = -0.9
# Rows within which one that stands twice is a slip of the recorder, not the start of another trial.
_NEAR = 50


def looked_at(log: OpenLog) -> OpenLog:
    """The log without repeated rows, and in a trial for each start of its clock, which its remarks say.

    Raises UserError, with line and column and what may mend it, for spools that stand still or jump as a counter that
    wraps, for bends, spools and times beyond any wrist's, and for two antagonists whose pull goes against the bend.
    """
    log = _parted(_without_repeats(log))
    _check_units(log)
    _check_spools(log)
    _check_senses(log)
    return log


def _without_repeats(log: OpenLog) -> OpenLog:
    if "time" not in log.columns or len(log) < 2:
        return log
    rows = pd.DataFrame({**log.columns, **log.words})
    before = rows.groupby(list(rows.columns), sort=False, dropna=False)["time"].transform(lambda twins: twins.index[0])
    behind = np.arange(len(log)) - before.to_numpy(dtype=int)
    same = (behind > 0) & (behind < _NEAR)
    if not same.any():
        return log
    kept, time = np.ones(len(log), dtype=bool), log.columns["time"]
    for later in np.flatnonzero(same):
        earlier = int(before.iloc[later])
        # Of two rows that are apart, the one that is out of order goes.
        early = earlier + 1 < later and time[earlier + 1] < time[earlier]
        kept[earlier if early else later] = False
    first = Path(log.at(int(np.flatnonzero(~kept)[0]))).name
    remark = f"{np.sum(~kept)} rows that stand twice, with their time, are used once; the first is at {first}."
    return replace(log.only(kept), remarks=[*log.remarks, remark])


def _parted(log: OpenLog) -> OpenLog:
    """With a trial for each start of the clock, where no column says the trials."""
    if "time" not in log.columns or "trial" in log.words:
        return log
    time = log.columns["time"]
    back = np.flatnonzero(np.diff(time) < 0.0) + 1
    # A clock that restarts is back near its start; single samples out of order are not.
    starts = [k for k in back if time[k] - time[0] < 0.1 * (time[k - 1] - time[0])]
    if not starts:
        return log
    trials = 1 + np.searchsorted(np.array(starts), np.arange(len(log)), side="right")
    places = ", ".join(Path(log.at(int(k))).name for k in starts[:3])
    remark = f"The clock starts again at {places}: each start is a trial of its own, {len(starts) + 1} in all."
    return replace(log, words={**log.words, "trial": trials.astype(str)}, remarks=[*log.remarks, remark])


def _check_units(log: OpenLog) -> None:
    for name in ("bend_y", "bend_z", "inclination"):
        column = np.abs(log.columns.get(name, np.empty(0)))
        if np.any(column > _BEND):
            reached, where = math.degrees(float(np.nanmax(column))), log.at(int(np.nanargmax(column)))
            raise UserError(f"{log.head(name)} reaches {reached:,.0f} deg by its header", where, "is it in degrees?")
    for number, spool in log.tendons("spool").items():
        if len(spool) and float(np.ptp(spool)) > _SPOOL:
            head = log.head(f"spool_{number}")
            problem = f"{head} moves {float(np.ptp(spool)):,.3g} m by its header"
            raise UserError(problem, log.at(int(np.argmax(np.abs(spool)))), "is it in mm?")
    for trial in log.trials().values():
        steps = np.diff(trial.columns.get("time", np.empty(0)))
        slow = steps.size > 0 and float(np.min(steps)) > _STEP and float(np.sum(steps)) > _LONG
        if slow and float(np.ptp(steps)) < 0.01 * float(np.median(steps)):
            problem = f"{float(np.median(steps)):.3g} s between samples of {log.head('time')}"
            raise UserError(problem, trial.at(1), "is it in ms?")


def _check_spools(log: OpenLog) -> None:
    spools = log.tendons("spool")
    if spools and len(log) > 1 and all(float(np.ptp(spool)) == 0.0 for spool in spools.values()):
        problem = "no spool moves: nothing can be identified from a log without motion"
        raise UserError(problem, log.header or str(log.file), "a log in which the tendons bend the wrist to both sides")
    if "time" not in log.columns or not spools:
        return
    for trial in log.trials().values():
        steps = np.diff(trial.columns["time"])
        ways = {number: np.diff(spool) for number, spool in trial.tendons("spool").items()}
        fast = {n: (np.abs(way) > _JUMP) & (np.abs(way) > _SPEED * steps) for n, way in ways.items()}
        together = np.sum(list(fast.values()), axis=0)
        for number, jumps in fast.items():
            alone = np.flatnonzero(jumps & (together == 1))
            if alone.size:
                row = int(alone[0])
                way = 1e3 * abs(float(ways[number][row]))
                problem = f"{log.head(f'spool_{number}')} jumps {way:.3g} mm between two samples, which no motor does"
                fix = "a counter that wraps (at 2^16 or an encoder's turn)? Unwrap it in the file"
                raise UserError(problem, trial.at(row + 1), fix)


def _check_senses(log: OpenLog) -> None:
    spools = log.tendons("spool")
    if list(spools) != [1, 2] or "bend_y" not in log.columns or "bend_z" in log.columns:
        return
    bend, pull = log.columns["bend_y"], spools[1] - spools[2]
    there = np.isfinite(bend)
    bend, pull = bend[there], pull[there]
    moves = len(bend) > 2 and np.ptp(bend) > 0.0 and np.ptp(pull) > 0.0
    if moves and float(np.corrcoef(bend, pull)[0, 1]) < _OPPOSITE:
        problem = f"{log.head('bend_y')} falls while tendon 1 is reeled in"
        fix = "tendons 1 and 2 exchanged, or the bend counted the other way: exchange spool_1 and spool_2"
        raise UserError(problem, log.header or str(log.file), fix)
