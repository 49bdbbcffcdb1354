"""Spools of logs against the places of their tendons: which are exchanged, and whose sign is the other one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.identification.arc_robot import ArcRobot
from wristctl.records.log_looks import columns_fix, turned_unit, unit_read
from wristctl.records.open_log import OpenLog

# Share of the spools' slopes that their places have to say, and of a spool's way that the bend has to say.
_LIKE, _SAID = 0.9, 0.5
# Smaller over larger standard deviation of the bends of two planes from which both are moved enough; else the motion is
# along one line, and places count by what they pull along that.
_BOTH = 0.2
# Most tendons of which every order is tried.
_ORDERS = 5


class _Reading(NamedTuple):
    """Another reading of a log: what it is in words, the slopes by it, and the columns that it takes."""

    words: str
    slopes: Array
    columns: dict[str, tuple[str, bool]]
    """By their names the columns that give them, and whether with the other sign."""


def check_places(logs: Sequence[OpenLog], robot: ArcRobot, numbers: Sequence[int]) -> list[str]:
    """Sentences where tendons pull toward other sides than their places say, all turned alike.

    The slopes of the spools' lengths over both bends, or over the tip's way across, are the tendons' directions; of a
    motion along one line they are what each tendon pulls along it. Raises
    UserError where they are none of the robot's, turned by less than half the angle between two tendons, but would be
    with one sign or with spools exchanged; the fix says so.
    """
    found = _slopes(logs, numbers)
    if found is None or "turn" not in robot.base:
        return []
    slopes, line = found
    places = np.exp(1j * np.array(robot.angles))
    if line is not None:
        places = line * (places * line.conjugate()).real
    around = np.sort(np.mod(robot.angles, math.tau))
    half = 0.5 * float(np.min(np.diff([*around, around[0] + math.tau])))
    like, turn = _likeness(slopes, places)
    if like >= _LIKE and abs(turn) < half:
        return []
    meant = next(
        (one for one in _readings(logs[0], slopes, numbers) if _fits(*_likeness(one.slopes, places), half)), None
    )
    log = logs[0]
    where = log.header or str(log.file)
    if like >= _LIKE:
        words = f", or {meant.words}" if meant else ""
        return [
            f"{where.rpartition('/')[2]}: all tendons pull {math.degrees(turn):.0f} deg from where wrist.tendons has "
            f"them: are the bend's axes turned{words}? The fit takes them as turned."
        ]
    if meant is None:
        return []
    read = {
        name: (log.head(column), turned_unit(log, column) if turned else unit_read(log, column))
        for name, (column, turned) in meant.columns.items()
    }
    problem = "the wrist does not bend toward the tendons that are reeled in"
    raise UserError(problem, where, columns_fix(log, f"it would if {meant.words}.", read))


def _fits(like: float, turn: float, half: float) -> bool:
    return like >= _LIKE and abs(turn) < half


def _likeness(slopes: Array, places: Array) -> tuple[float, float]:
    """Share of slopes (M,) that places (M,) say, all turned and scaled alike, and that turn [rad]."""
    common = np.vdot(places, slopes)
    whole = float(np.vdot(places, places).real * np.vdot(slopes, slopes).real)
    return float(abs(common) ** 2) / whole if whole else 0.0, float(np.angle(common))


def _readings(log: OpenLog, slopes: Array, numbers: Sequence[int]) -> Iterator[_Reading]:
    """Other readings, the simplest first: a spool's sign, two spools exchanged, a bend's sign, other orders."""
    names = [f"spool_{number}" for number in numbers]
    heads = [log.head(name) for name in names]
    for k, name in enumerate(names):
        signs = np.where(np.arange(len(names)) == k, -1.0, 1.0)
        yield _Reading(f"{heads[k]} had the other sign", signs * slopes, {name: (name, True)})
    for one, two in combinations(range(len(names)), 2):
        order = list(range(len(names)))
        order[one], order[two] = two, one
        exchanged = {names[one]: (names[two], False), names[two]: (names[one], False)}
        yield _Reading(f"{heads[one]} and {heads[two]} were exchanged", slopes[order], exchanged)
    for name, mirrored in (("bend_z", np.conj(slopes)), ("bend_y", -np.conj(slopes))):
        if name in log.columns:
            yield _Reading(f"{log.head(name)} were counted the other way", mirrored, {name: (name, True)})
    for order_of in permutations(range(len(names))) if len(names) <= _ORDERS else ():
        taken = {names[k]: (names[other], False) for k, other in enumerate(order_of) if other != k}
        words = ", ".join(f"{heads[other]} is of tendon {numbers[k]}" for k, other in enumerate(order_of) if other != k)
        yield _Reading(f"spools were exchanged: {words}", slopes[list(order_of)], taken)


def _slopes(logs: Sequence[OpenLog], numbers: Sequence[int]) -> tuple[Array, complex | None] | None:
    """Slopes of the spools (M,) over the bends, complex: toward y and z, and the direction of a motion along one line.

    None where the motion does not tell them.
    """
    moved, reeled = list[Array](), list[Array]()
    for trial in (trial for log in logs for trial in log.trials().values()):
        motion = _motion(trial)
        if motion is None:
            return None
        clock = trial.columns.get("time", np.arange(len(trial), dtype=np.float64))
        seen = np.isfinite(motion).all(axis=1)
        spools = [trial.columns[f"spool_{number}"] for number in numbers]
        if seen.sum() < 2 or not all(np.isfinite(spool).any() for spool in spools):
            continue
        there = [np.isfinite(spool) for spool in spools]
        columns = [np.interp(clock[seen], clock[t], spool[t]) for t, spool in zip(there, spools, strict=True)]
        moved.append(motion[seen] - motion[seen].mean(axis=0))
        reeled.append(np.array([column - column.mean() for column in columns]).T)
    if not moved:
        return None
    motion, spool = np.concatenate(moved), np.concatenate(reeled)
    _, sizes, axes = np.linalg.svd(motion, full_matrices=False)
    flat = sizes[1] < _BOTH * sizes[0]
    both = np.linalg.lstsq(motion, spool, rcond=_BOTH)[0]
    left, whole = np.sum((spool - motion @ both) ** 2, axis=0), np.sum(spool**2, axis=0)
    if flat:  # a tendon across the line does not move with it
        left, whole = left.sum(keepdims=True), whole.sum(keepdims=True)
    if not whole.any() or np.any(left > (1.0 - _SAID) * whole):
        return None
    return both[0] + 1j * both[1], complex(*axes[0]) if flat else None


def _motion(log: OpenLog) -> Array | None:
    bends = log.bends()
    if bends is None and {"tip_y", "tip_z"} <= log.columns.keys():
        bends = np.stack([log.columns["tip_y"], log.columns["tip_z"]], axis=1)
    return bends
