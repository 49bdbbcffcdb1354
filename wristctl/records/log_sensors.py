"""Sensors of logs that stand, are at their ends, or are of another clock: sentences, for a fit takes it as motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.records.log_jumps import lone_cells
from wristctl.records.open_log import OpenLog, filled

# Median of the absolute value of a normal variable, over its standard deviation; scatter [m] of a spool from which it
# is noise, and least ratio of its fifth to its third differences.
_MEDIAN, _SCATTER, _NOISE_LIKE = 0.6745, 5e-5, 0.8
# Rows of a standstill, and share of its whole way that the rest moves meanwhile, from which a sensor stands alone.
_ROWS, _MOVED = 20, 0.2
# The same where it catches up in one step, and of a column in which at most such a share of the other rows stands.
_FEW_ROWS, _MOVED_A_LITTLE, _NEVER = 4, 0.02, 0.02
# Rows at an end of a sensor's range, and share of its way that the pull moves meanwhile.
_AT_END, _BEYOND = 5, 0.1
# Step at the end of a standstill over the largest of 99 in 100 others, from which the sensor had stood alone.
_CATCHES_UP = 3.0
# Delay [s], likeness with it, and how many times as far from one the likeness is without it, from which it is told.
_LATE, _ALIKE, _BETTER = 0.25, 0.98, 4.0
# The same of a motion that comes before its pull, which no wrist does.
_EARLY, _BETTER_EARLY = 0.03, 2.0
# Share of a spool's way that the motion says of one that goes with it, at most of one that does not, and least way of
# that over the furthest spool's.
_GOES, _GOES_NOT, _LEAST_WAY = 0.9, 0.5, 0.02
# Most correlation of what the motion does not say of such a spool with the row before: a motion of its own is smooth.
_ROUGH = 0.8
# Share of the furthest spool's way below which one that goes with the motion is of another unit.
_MUCH_LESS = 0.02
# Most instants at which two streams are held against each other, and longest delay that is looked for [s].
_INSTANTS, _LONGEST = 2000, 5.0
# Delays to either side that are looked at first, and likeness that is as good as the best.
_COARSE, _ALMOST = 50, 0.02


_SEEN = ("bend_", "inclination", "tip_", "spool_", "tension_")
"""Beginnings of the names of columns that a sensor gives."""


class _Run(NamedTuple):
    """Rows from the first to the last that a column stands at one value."""

    first: int
    last: int


def sensors_told(log: OpenLog) -> list[str]:
    """A sentence for each column that stands while the rest moves, that is cut off at an end, or comes late.

    The motion is the bend or the tip's place across, held against what all spools together make of it by least squares.
    """
    name = next((name for name in ("bend_y", "bend_z", "inclination", "tip_y") if name in log.columns), None)
    told = list[str]()
    for column in log.columns if "time" in log.columns else ():
        told += lone_cells(log, column) if column.startswith(_SEEN) else []
    for trial in log.trials().values() if name else ():
        spools = [column for column in trial.columns if column.startswith("spool_")]
        time = trial.time
        assert name is not None
        seen = np.flatnonzero(np.isfinite(trial.columns[name]))
        if len(seen) < 2 * _ROWS or not spools or np.ptp(trial.columns[name][seen]) == 0.0:
            continue
        reeled = np.stack([filled(time, trial.columns[spool])[seen] for spool in spools], axis=1)
        whole = np.isfinite(reeled).all(axis=1)
        seen, reeled = seen[whole], reeled[whole]
        if len(seen) < 2 * _ROWS or not np.ptp(reeled, axis=0).any():
            continue
        motion = trial.columns[name][seen]
        made = _made_of(reeled, motion)
        ends = _at_ends(motion, made)
        frozen = [run for run in _standing(motion, made) if run not in ends]
        told += _sentence(trial, name, seen, ends, "stops at {value} as a sensor at its end does")
        told += _sentence(trial, name, seen, frozen, "stands at {value} while the spools move")
        for place, spool in enumerate(spools):
            others = np.delete(reeled, place, axis=1)
            if others.size and np.isfinite(trial.columns[spool][seen]).all():
                alone = _standing(reeled[:, place], motion, others)
                told += _sentence(trial, spool, seen, alone, "stands at {value} while the wrist moves")
        stand = [run for run in _standing(made, motion) if not np.ptp(reeled[run.first : run.last + 1], axis=0).any()]
        told += _sentence(trial, spools[0], seen, stand, "stands at {value}, as all spools do, while the wrist moves")
        told += _rough(trial, spools)
        told += _apart(trial, spools, reeled, _motion_of(trial, seen))
        if "time" in trial.columns:
            told += _late(trial, name, time[seen], motion, reeled)
    return list(dict.fromkeys(told))[:6]


def _made_of(reeled: Array, motion: Array) -> Array:
    """What spools (T, N) make of a motion (T,), by least squares."""
    moved = reeled - reeled.mean(axis=0)
    made: Array = moved @ np.linalg.lstsq(moved, motion - motion.mean(), rcond=1e-9)[0]
    return made


def _runs(column: Array, fewest: int) -> list[_Run]:
    """Rows between which a column stands, where it does so for many more than it mostly does."""
    changes = np.flatnonzero(np.diff(column) != 0.0)
    bounds = np.concatenate([[-1], changes, [len(column) - 1]])
    lengths = np.diff(bounds)
    enough = max(fewest, 5.0 * float(np.median(lengths)))
    return [_Run(int(bounds[k]) + 1, int(bounds[k + 1])) for k in np.flatnonzero(lengths >= enough)]


def _moved(column: Array, run: _Run) -> float:
    """Share of its whole way that a column moves in a run."""
    way = float(np.ptp(column))
    return float(np.ptp(column[run.first : run.last + 1])) / way if way else 0.0


def _standing(column: Array, rest: Array, others: Array | None = None) -> list[_Run]:
    """Runs in which a column stands while the rest moves, until it catches up in one step, or to the end.

    Short ones count where the rest moves far, and the column stands nowhere else.
    """
    if not np.ptp(column):
        return []
    steps = np.abs(np.diff(column))
    usual = float(np.quantile(steps[steps > 0.0], 0.99))
    found = list[_Run]()
    for run in _runs(column, _FEW_ROWS):
        way = min(_moved(rest, run), 1.0 if others is None else max(_moved(other, run) for other in others.T))
        ends = run.last + 1 == len(column)
        catches_up = not ends and steps[run.last] > _CATCHES_UP * usual
        to_end = ends or catches_up or steps[run.last] > _MOVED * np.ptp(column)
        long = way > _MOVED and to_end and run.last - run.first + 1 >= _ROWS
        short = way > _MOVED_A_LITTLE and catches_up
        stands_elsewhere = float(np.mean(np.delete(steps, np.arange(run.first, run.last)) == 0.0)) >= _NEVER
        far = way > 0.5 * _MOVED or (way > _MOVED_A_LITTLE and _jumps_after(steps, run))
        alone = far and not stands_elsewhere
        if long or short or alone:
            found.append(run)
    return found


def _jumps_after(steps: Array, run: _Run) -> bool:
    """Whether a step at the end of a run is far larger than those before it and after it."""
    near = np.concatenate([steps[max(0, run.first - _ROWS) : max(0, run.first - 1)], steps[run.last + 1 :][:_ROWS]])
    return run.last < len(steps) and bool(steps[run.last] > _CATCHES_UP * float(np.max(near, initial=0.0)))


def _at_ends(motion: Array, made: Array) -> list[_Run]:
    """Runs at the largest or the smallest value of a motion, of which the pull goes on."""
    ends = (float(motion.max()), float(motion.min()))
    return [run for run in _runs(motion, _AT_END) if motion[run.first] in ends and _turns_within(made, run)]


def _turns_within(made: Array, run: _Run) -> bool:
    """Whether the pull goes on and comes back within a run, by more than a share of its way."""
    within = made[run.first : run.last + 1]
    return _moved(made, run) > _BEYOND and abs(within[0] - within[-1]) < 0.5 * float(np.ptp(within))


def _sentence(log: OpenLog, name: str, rows: NDArray[np.intp], runs: list[_Run], what: str) -> list[str]:
    if not runs:
        return []
    first, last = (log.place(int(rows[row])) for row in runs[0])
    scale = log.scales.get(name, 1.0)
    value = f"{log.columns[name][rows[runs[0].first]] / scale:.4g}"
    more = f", and {len(runs) - 1} times more" if len(runs) > 1 else ""
    until = last.rpartition(":")[2] if ":" in last else last
    return [
        f"{first} to {until}{more}: {log.head(name)} {what.format(value=value)}. If it did, leave these cells empty."
    ]


def _motion_of(log: OpenLog, rows: NDArray[np.intp]) -> Array:
    """Bends, or the tip's way, at some rows (T, 2 or 3); of what is not measured nothing."""
    bends = log.bends()
    tips = [log.columns[name] for name in ("tip_x", "tip_y", "tip_z") if name in log.columns]
    both = bends[rows] if bends is not None else np.stack(tips, axis=1)[rows]
    known = np.isfinite(both).any(axis=0)  # a bend that no row has tells nothing
    moved: Array = np.nan_to_num(both[:, known] - np.nanmean(both[:, known], axis=0))
    return moved


def _rough(log: OpenLog, spools: list[str]) -> list[str]:
    """A sentence for spools that differ from row to row as noise does, not as a motion.

    Differences of third and fifth order of noise are as large as their coefficients say; of a motion the fifth are
    less.
    """
    sizes = dict[str, float]()
    for spool in spools:
        column = log.columns[spool][np.isfinite(log.columns[spool])]
        third, fifth = (
            float(np.median(np.abs(np.diff(column, order)))) / (_MEDIAN * math.sqrt(math.comb(2 * order, order)))
            for order in (3, 5)
        )
        if third > _SCATTER and fifth > _NOISE_LIKE * third:
            sizes[spool] = third
    if not sizes:
        return []
    names = ", ".join(log.head(spool) for spool in sizes)
    return [
        f"{log.place()}: {names} scatter by {1e3 * max(sizes.values()):.2g} mm from row to row, as noise does; a fit "
        "takes that as pulls, and tendons as softer than they are."
    ]


def _apart(log: OpenLog, spools: list[str], reeled: Array, motion: Array) -> list[str]:
    """A sentence for each spool that does not go with the motion where another does, or goes with it far less."""
    moved = reeled - reeled.mean(axis=0)
    ways = np.ptp(moved, axis=0)
    left = moved - motion @ np.linalg.lstsq(motion, moved, rcond=1e-9)[0]
    said = 1.0 - np.sum(left**2, axis=0) / np.maximum(np.sum(moved**2, axis=0), 1e-300)
    if said.max() < _GOES:
        return []
    other, furthest = log.head(spools[int(said.argmax())]), log.head(spools[int(ways.argmax())])
    where, told = log.place(), list[str]()
    for spool, share, way, own in zip(spools, said, ways, left.T, strict=True):
        rough = float(own[1:] @ own[:-1]) < _ROUGH * float(own @ own)
        if share < _GOES_NOT and way > _LEAST_WAY * ways.max() and rough:
            cause = "is it a counter that wraps at every turn, or noise?"
            told.append(f"{where}: {log.head(spool)} does not go with the wrist as {other} does; {cause}")
        elif share > _GOES and way < _MUCH_LESS * ways.max():
            told.append(
                f"{where}: {log.head(spool)} goes with the wrist, and moves {1e3 * way:.2g} mm where {furthest} moves "
                f"{1e3 * float(ways.max()):.2g} mm; is it in another unit?"
            )
    return told


def _late(log: OpenLog, name: str, time: Array, motion: Array, reeled: Array) -> list[str]:
    """A sentence where a motion is like what the spools make of it at another time, and not at its own."""
    count = min(_INSTANTS, len(time))
    even = np.linspace(time[0], time[-1], count)
    step = float(even[1] - even[0])
    if step <= 0.0:
        return []
    most = min(count // 4, int(_LONGEST / step))
    one, others = np.interp(even, time, motion), np.array([np.interp(even, time, spool) for spool in reeled.T]).T
    stride = max(1, most // _COARSE)
    coarse = np.arange(-(most // stride), most // stride + 1) * stride
    alike = np.array([_likeness(one, others, int(lag)) for lag in coarse])
    near = coarse[alike > float(alike.max()) - _ALMOST]  # of several alike the nearest lag
    middle = int(near[np.argmin(np.abs(near))])
    fine = np.arange(max(-most, middle - 2 * stride), min(most, middle + 2 * stride) + 1)
    likeness = np.array([_likeness(one, others, int(lag)) for lag in fine])
    best, now = float(likeness.max()), _likeness(one, others, 0)
    late = float(fine[np.argmax(likeness)]) * step
    least, better = (_LATE, _BETTER) if late > 0.0 else (max(_EARLY, 1.5 * step), _BETTER_EARLY)
    if abs(late) < least or best < _ALIKE or 1.0 - now < better * (1.0 - best):
        return []
    side = "behind" if late > 0.0 else "ahead of"
    cause = (
        "are both of one clock, or is it the wrist's damping?"
        if late > 0.0
        else "no wrist does so: are both of one clock?"
    )
    return [f"{log.place()}: {log.head(name)} is {abs(late):.2g} s {side} the spools all along; {cause}"]


def _likeness(motion: Array, reeled: Array, lag: int) -> float:
    """Multiple correlation of a motion (T,) with the spools (T, M) `lag` instants before."""
    one = motion[lag:] if lag >= 0 else motion[:lag]
    other = reeled[: len(reeled) - lag] if lag >= 0 else reeled[-lag:]
    moved, pulled = one - one.mean(), other - other.mean(axis=0)
    whole = float(moved @ moved)
    if whole == 0.0:
        return 0.0
    left = moved - pulled @ np.linalg.lstsq(pulled, moved, rcond=1e-9)[0]
    return float(np.sqrt(max(0.0, 1.0 - float(left @ left) / whole)))
