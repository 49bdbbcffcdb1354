"""Counters of logs that jump where the wrist does not, and cells that stand alone: a fit takes either as motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.open_log import OpenLog

# Step over what 95 in 100 others have at most from which it is a jump, or a cell alone, and a jump's least length [m].
_FAR, _ALONE, _LEAST = 4.0, 6.0, 1e-4
# Share of what the rest does not say of a spool that is left at most where its jumps are taken out: refused, or said.
_SURELY, _BETTER = 0.05, 0.2
# Most jumps of a column, as a share of its rows.
_OFTEN = 0.1
_MOTION = ("bend_y", "bend_z", "inclination", "orientation", "tip_x", "tip_y", "tip_z")

Rows = NDArray[np.intp]


def jumps_told(log: OpenLog) -> list[str]:
    """A sentence for a spool that jumps where neither the wrist nor the other spools do.

    It does so where the rest says the spool much better (least squares) once its jumps are taken out of it. Raises
    UserError, with line and column, where they are almost all that the rest does not say.
    """
    told = list[str]()
    for trial in log.trials().values():
        spools, time = [name for name in trial.columns if name.startswith("spool_")], trial.time
        for name in spools:
            there = np.flatnonzero(np.isfinite(trial.columns[name]))
            values = trial.columns[name][there]
            jumps, without = _without_jumps(values)
            others = [other for other in (*_MOTION, *spools) if other in trial.columns and other != name]
            known = [(trial.columns[other], np.isfinite(trial.columns[other])) for other in others]
            rest = np.array([np.interp(time[there], time[at], x[at]) for x, at in known if at.any()]).T
            if not jumps.size or not rest.size:
                continue
            left, better = _left(values, rest), _left(without, rest)
            if better > _BETTER * left:
                continue
            way, place = 1e3 * abs(float(np.diff(values)[jumps[0] - 1])), trial.at(int(there[jumps[0]]))
            more = f", and at {len(jumps) - 1} rows more" if len(jumps) > 1 else ""
            problem = f"{trial.head(name)} jumps {way:.3g} mm between two samples{more}, and the wrist does not"
            fix = "a counter that wraps (at an encoder's turn), or lost steps? Mend it in the file"
            if better < _SURELY * left:
                raise UserError(problem, place, fix)
            told.append(f"{Path(place).name}: {problem}. Is it {fix}.")
    return told


def lone_cells(log: OpenLog, name: str) -> list[str]:
    """A sentence where cells of a column stand far from both of their neighbours, which agree with each other."""
    found = list[int]()
    for trial in log.trials().values():
        column = trial.columns[name]
        there = np.flatnonzero(np.isfinite(column))
        alone = _alone(column[there])
        found += [int(trial.lines[row]) if trial.lines else int(row) for row in there[alone]]
    if not found:
        return []
    lines = ", ".join(map(str, found[:3])) + (", ..." if len(found) > 3 else "")
    where = f"{log.file.name}:{lines}"
    cells = "a cell stands" if len(found) == 1 else f"{len(found)} cells stand"
    return [f"{where}: {cells} alone in {log.head(name)}, far from the rows before and after; leave such cells empty."]


def _alone(values: Array) -> Rows:
    """Places of values that go far to one side and back again in one step each."""
    steps = np.diff(values)
    if len(steps) < 20 or not steps.any():
        return np.empty(0, np.intp)
    far = _ALONE * float(np.quantile(np.abs(steps[steps != 0.0]), 0.95))
    before, after = steps[:-1], steps[1:]
    back = (before * after < 0.0) & (np.minimum(np.abs(before), np.abs(after)) > far)
    return np.flatnonzero(back & (np.abs(before + after) < 0.5 * np.minimum(np.abs(before), np.abs(after)))) + 1


def _without_jumps(values: Array) -> tuple[Rows, Array]:
    """Places after jumps, and the values as if they went on there as in the steps beside; none of too many."""
    steps = np.diff(values)
    moving = np.abs(steps[steps != 0.0])
    if len(moving) < 20:
        return np.empty(0, np.intp), values
    jumps = np.flatnonzero(np.abs(steps) > max(_FAR * float(np.quantile(moving, 0.95)), _LEAST))
    if not jumps.size or len(jumps) > _OFTEN * len(values):
        return np.empty(0, np.intp), values
    calm = np.delete(np.arange(len(steps)), jumps)
    mended = steps.copy()
    mended[jumps] = np.interp(jumps, calm, steps[calm])
    return jumps + 1, np.concatenate([values[:1], values[0] + np.cumsum(mended)])


def _left(values: Array, rest: Array) -> float:
    """Sum of squares of values (T,) that the rest (T, C) does not say, by least squares."""
    slopes = np.column_stack([np.ones(len(values)), rest - rest.mean(axis=0)])
    slopes /= np.maximum(np.linalg.norm(slopes, axis=0), 1e-12)
    left: Array = values - slopes @ np.linalg.lstsq(slopes, values, rcond=1e-9)[0]
    return float(left @ left)
