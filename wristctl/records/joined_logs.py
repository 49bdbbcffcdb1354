"""Logs of motors and logs of the motion, on clocks of their own, joined into logs of both.

Bends are nearly linear in spools, tensions or currents. The shift between two clocks is that at which a straight line
through all of these leaves the least of the motion over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.open_log import OpenLog

_MOVES = ("bend_y", "bend_z", "inclination", "tip_x", "tip_y", "tip_z")
_DRIVES = ("spool", "tension", "current")
# Instants at which two logs are held against each other, time between two shifts that are tried [s], their largest
# number, and share of the shorter log that both have at least.
_INSTANTS, _EVERY, _MOST, _SHARED = 400, 0.03, 20_000, 0.5
# Share of the motion that the motors have to say; what may be left over of another shift over the least, and how much
# more of the motion: a line leaves that over of any motion that comes back, at one shift or another.
_SAID, _AS_WELL, _NO_WORSE = 0.5, 1.5, 1e-3
# Shift [s] up to which two clocks may be the same, and one stream late.
_SAME = 0.1
_COMES_BACK = "one clock for both, or a motion that does not come back, such as a move of its own at the begin"
# Time [s] by which the joined motion comes later than at the best shift: a fit then finds a delay that is not negative.
_LATER = 0.05


class _Streams(NamedTuple):
    """Times (T,) [s] and values (T, D) of two logs that are to be joined."""

    driven_at: Array
    drives: Array
    moved_at: Array
    moves: Array

    def left_over(self, shift: float) -> float:
        """Share of the motion that a line through the motors leaves over, where its times are later by a shift [s].

        Infinite where both share too little of the motion.
        """
        begin = max(self.driven_at[0], self.moved_at[0] + shift)
        end = min(self.driven_at[-1], self.moved_at[-1] + shift)
        time, ones = np.linspace(begin, end, _INSTANTS), np.ones((_INSTANTS, 1))
        drives = np.hstack([ones, *(np.interp(time, self.driven_at, x)[:, None] for x in self.drives.T)])
        moves = np.stack([np.interp(time - shift, self.moved_at, x) for x in self.moves.T], axis=1)
        whole = float(np.sum((moves - moves.mean(axis=0)) ** 2)) / _INSTANTS
        if whole < _SHARED * float(self.moves.var(axis=0).sum()):
            return math.inf
        line = np.linalg.lstsq(drives, moves, rcond=1e-9)[0]
        return float(np.sum((moves - drives @ line) ** 2)) / _INSTANTS / whole

    def trough(self, near: float, within: float) -> _Shift:
        """The shift [s] within so much of one near it that leaves the least over."""
        found = minimize_scalar(
            lambda more: self.left_over(float(near + more)),
            bounds=(-within, within), method="bounded", options={"xatol": 1e-4},
        )  # fmt: skip
        return _Shift(float(near + found.x), float(found.fun))


class _Shift(NamedTuple):
    """A shift of clocks [s] and the share of the motion that it leaves over."""

    time: float
    left: float


def joined_logs(logs: Sequence[OpenLog]) -> list[OpenLog]:
    """Logs of which one has the motors alone and the next the motion alone as one log; others as they are.

    The motion's times are shifted to the motors' clock, which a remark says; what was seen before or after motors were
    logged is left out. Of shifts that do as well it is the one at which the clocks are the same, if one is. Raises
    UserError where there are not as many of either kind, without times, and where no shift, or another more than one,
    brings both together.
    """
    drives = [log for log in logs if _drives(log) and not _moves(log)]
    motions = [log for log in logs if _moves(log) and not _drives(log)]
    if not drives or not motions:
        return list(logs)
    if len(drives) != len(motions):
        problem = f"{len(drives)} logs of motors and {len(motions)} of the motion"
        raise UserError(problem, str(logs[0].file), "as many of either, in the order of their recordings")
    parts = {id(log) for log in (*drives, *motions)}
    whole = [log for log in logs if id(log) not in parts]
    return [*whole, *(_joined(drive, motion) for drive, motion in zip(drives, motions, strict=True))]


def check_whole(logs: Sequence[OpenLog]) -> None:
    """UserError for a log of the motion alone, or of motors alone, beside one that has both."""
    whole = next((log.file.name for log in logs if _drives(log) and _moves(log)), None)
    for log in logs if whole else ():
        has, lacks = ("motion", "motors") if _moves(log) else ("motors", "motion")
        if not (_drives(log) and _moves(log)):
            problem = f"it has no {lacks} of its own, and there is nothing to join it to: {whole} has motors and motion"
            fix = f"leave this file out, or take the {has} out of {whole}"
            raise UserError(problem, log.header or str(log.file), fix)


def _drives(log: OpenLog) -> list[str]:
    return [f"{quantity}_{number}" for quantity in _DRIVES for number in log.tendons_of(quantity)]


def _moves(log: OpenLog) -> list[str]:
    return [name for name in _MOVES if name in log.columns]


def _joined(drive: OpenLog, motion: OpenLog) -> OpenLog:
    for log in (drive, motion):
        if "time" not in log.columns:
            raise UserError("no times, and it is to be joined to another log", log.header or str(log.file), "time [s]")
        if "trial" in log.words:
            fix = "one recording in each file, and further pairs of files for further trials"
            raise UserError("trials, and it is to be joined to another log", log.header or str(log.file), fix)
    streams = _Streams(*_stream(drive, _drives(drive)), *_stream(motion, _moves(motion)))
    shift, others = _shift(streams, motion, drive)
    later = motion.columns["time"] + shift.time + _LATER
    driven = (later >= streams.driven_at[0]) & (later <= streams.driven_at[-1])
    columns = {name: column[driven] for name, column in motion.columns.items() if name not in drive.columns}
    times = (drive.columns["time"], later[driven])
    time = np.unique(np.concatenate(times))
    merged = {"time": time}
    for part, at in ((drive.columns, times[0]), (columns, times[1])):
        rows = np.searchsorted(time, at)
        for name in part.keys() - {"time"}:
            merged[name] = np.full(len(time), math.nan)
            merged[name][rows] = part[name]
    said = (
        f"{motion.file.name} is joined to {drive.file.name}, {shift.time:+.3f} s from its own clock, where the motors "
        f"say {100.0 * (1.0 - shift.left):.0f} % of the motion. {others}Of two clocks the delay is not identifiable."
    )
    remarks = [*drive.remarks, *motion.remarks, said]
    heads = {**motion.heads, **drive.heads}
    return replace(drive, columns=merged, words={}, lines=(), heads=heads, remarks=remarks, two_clocks=True)


def _stream(log: OpenLog, names: Sequence[str]) -> tuple[Array, Array]:
    """Times (T,) and columns (T, D) of a log, where all of them are there."""
    values = np.stack([log.columns[name] for name in names], axis=1)
    values = values[:, np.isfinite(values).any(axis=0)]
    there = np.isfinite(values).all(axis=1)
    if there.sum() < 2:
        raise UserError(f"{int(there.sum())} rows with {', '.join(names)}", log.header or str(log.file), "more")
    time = log.columns["time"][there]
    return time, values[there]


def _as_well(least: float) -> float:
    """Share of the motion that a shift may leave over that does as well as the best one."""
    return max(_AS_WELL * least, least + _NO_WORSE)


def _shift(streams: _Streams, motion: OpenLog, drive: OpenLog) -> tuple[_Shift, str]:
    """The shift of the motion's times, and a sentence on others that do as well. Raises UserError without one."""
    spans = [float(at[-1] - at[0]) for at in (streams.driven_at, streams.moved_at)]
    step = max(_EVERY, sum(spans) / _MOST)
    shared = _SHARED * min(spans)
    first = streams.driven_at[0] - streams.moved_at[-1] + shared
    shifts = np.arange(first, streams.driven_at[-1] - streams.moved_at[0] - shared + step, step)
    left = np.array([streams.left_over(float(shift)) for shift in shifts])
    troughs = np.flatnonzero((left[1:-1] <= left[:-2]) & (left[1:-1] < left[2:])) + 1
    lowest = 2.0 * left[troughs] - np.maximum(left[troughs - 1], left[troughs + 1])  # that a trough goes down to
    tried = {int(np.argmin(left)), *map(int, troughs[lowest <= _as_well(float(left.min()))])}
    found = sorted((streams.trough(float(shifts[k]), step) for k in tried), key=lambda shift: shift.left)
    best, where = found[0], motion.header or str(motion.file)
    if not best.left <= 1.0 - _SAID:
        fix = "are both of one recording, and spools of all tendons there?"
        raise UserError(f"at no shift of clocks does its motion go with {drive.file.name}", where, fix)
    most = _as_well(best.left)
    alike = [shift for shift in found if shift.left <= most and abs(shift.time - best.time) > step]
    if not alike:
        return best, ""
    zero = _Shift(0.0, streams.left_over(0.0))
    same = zero if zero.left <= most else min((best, *alike), key=lambda shift: abs(shift.time))
    if abs(same.time) > _SAME:
        problem = f"shifts of {best.time:.3g} and {alike[0].time:.3g} s join it to {drive.file.name} alike"
        raise UserError(problem, where, _COMES_BACK)
    other = max((best, *alike), key=lambda shift: abs(shift.time))
    return same, f"The motion comes back, so that {other.time:+.3g} s does as well; the clocks are taken for the same. "
