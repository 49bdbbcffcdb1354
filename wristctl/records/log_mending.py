"""Logs mended before a look at them: counters that wrap go on, rows that stand twice go, all in the order of times.

A clock that starts again starts a trial.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.column_ranges import counter_of
from wristctl.records.open_log import OpenLog

# Rows within which one that stands twice, or out of order, is a slip of the recorder, not the start of another trial.
_NEAR = 50


def without_wraps(log: OpenLog) -> OpenLog:
    """The log with spools and times that count on where a whole counter begins again, which its remarks say.

    A column is a counter where its numbers are whole, all in the range of 16 or 32 bits, signed or not, and where its
    largest steps are that range within a tenth while all others are below a tenth of it.
    """
    columns, told = dict(log.columns), list[str]()
    for name, scale in log.scales.items():
        if name not in columns or (name != "time" and not name.startswith("spool_")):
            continue
        there = np.flatnonzero(np.isfinite(columns[name]))
        counts = columns[name][there] / scale
        if len(there) < 3 or (counter := counter_of(counts)) is None:
            continue
        size, turns = counter
        columns[name] = columns[name].copy()
        columns[name][there] = scale * (np.round(counts) + size * turns)
        wraps = np.flatnonzero(np.diff(turns)) + 1
        where = log.place(int(there[wraps[0]]))
        more = f", {len(wraps)} times in all" if len(wraps) > 1 else ""
        power = size.bit_length() - 1
        told.append(f"{log.head(name)} begins again after 2^{power} counts at {where}{more}: it is taken to go on.")
    return replace(log, columns=columns, remarks=[*log.remarks, *told]) if told else log


def without_repeats(log: OpenLog) -> OpenLog:
    """The log without rows that stand twice, with their time, near each other."""
    if "time" not in log.columns or len(log) < 2:
        return log
    rows = pd.DataFrame({**log.columns, **log.words})
    if not rows.duplicated().any():
        return log
    same_rows = pd.Series(np.arange(len(log))).groupby([rows[name] for name in rows], sort=False, dropna=False)
    before = same_rows.transform("min").to_numpy(dtype=int)
    behind = np.arange(len(log)) - before
    same = (behind > 0) & (behind < _NEAR)
    if not same.any():
        return log
    kept, time = np.ones(len(log), dtype=bool), log.columns["time"]
    for later in np.flatnonzero(same):
        earlier = int(before[later])
        # Of two rows that are apart, the one that is out of order goes.
        early = earlier + 1 < later and time[earlier + 1] < time[earlier]
        kept[earlier if early else later] = False
    first = log.place(int(np.flatnonzero(~kept)[0]))
    remark = f"{np.sum(~kept)} rows that stand twice, with their time, are used once; the first is at {first}."
    return replace(log.only(kept), remarks=[*log.remarks, remark])


def parted(log: OpenLog) -> OpenLog:
    """With a trial for each start of the clock; those of a trial that has a name are numbered."""
    if "time" not in log.columns:
        return log
    names = log.words.get("trial", np.full(len(log), ""))
    parts, starts = names.astype(object), list[int]()
    for name in dict.fromkeys(names.tolist()):
        rows = np.flatnonzero(names == name)
        of_trial = [int(row) for row in rows[_restarts(log.columns["time"][rows])]]
        if of_trial:
            numbers = 1 + np.searchsorted(np.array(of_trial), rows, side="right")
            parts[rows] = [f"{name}, {number}" if name else str(number) for number in numbers]
            starts += of_trial
    if not starts:
        return log
    places = ", ".join(log.place(row) for row in sorted(starts)[:3])
    count = len(set(parts.tolist()))
    remark = f"The clock starts again at {places}: each start is a trial of its own, {count} in all."
    return replace(log, words={**log.words, "trial": parts.astype(str)}, remarks=[*log.remarks, remark])


def _restarts(time: Array) -> list[int]:
    """Rows at which a clock is back near its start; single samples out of order are not."""
    back = np.flatnonzero(np.diff(time) < 0.0) + 1
    first, found = 0, list[int]()
    for row in back.tolist():
        if time[row] - time[first] < 0.1 * (time[row - 1] - time[first]) and not _returns(time, row):
            found.append(row)
            first = row
    return found


def _returns(time: Array, row: int) -> bool:
    """Whether a time that goes back at a row is where it was soon, in one step: single rows have come late."""
    after = time[row : row + _NEAR]
    forward = np.flatnonzero(after >= time[row - 1])
    if not forward.size:
        return False
    usual = float(np.median(np.abs(np.diff(time))))
    step = after[forward[0]] - after[forward[0] - 1]
    return bool(step > 1.5 * usual)


def in_order(log: OpenLog) -> OpenLog:
    """With each trial's rows in the order of their times. Raises UserError where many would move."""
    if "time" not in log.columns:
        return log
    parts = [np.arange(len(log))]
    if "trial" in log.words:
        parts = [np.flatnonzero(log.words["trial"] == name) for name in dict.fromkeys(log.words["trial"])]
    order, moved = np.arange(len(log)), list[int]()
    for rows in parts:
        time = log.columns["time"][rows]
        if not (np.diff(time) < 0.0).any():
            continue
        sorted_rows = np.argsort(time, kind="stable")
        far = np.abs(sorted_rows - np.arange(len(rows)))
        if int(far.max()) > _NEAR:
            late = int(rows[np.flatnonzero(np.diff(time) < 0.0)[0] + 1])
            step = float(log.columns["time"][late - 1] - log.columns["time"][late])
            problem = f"{log.head('time')} goes back by {step:.4g} s"
            raise UserError(problem, log.at(late), "two recordings in one? Give each its own trial in a column trial")
        moved += rows[np.flatnonzero(np.diff(time) < 0.0) + 1].tolist()
        order[rows] = rows[sorted_rows]
    if not moved:
        return log
    first = log.place(moved[0])
    remark = f"{len(moved)} rows that come late are put in the order of their times; the first is at {first}."
    return replace(log.only(order), remarks=[*log.remarks, remark])
