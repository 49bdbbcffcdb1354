"""Samples that were measured: tips and angles of recordings, from tables of runs or from CSV files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.domain import OTHERS, Domain, arc_to
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at, telling

# Columns of a table of a run that hold a course: the tip and the bend, in one plane and in two.
NEEDED = ("tip_x", "tip_y", "theta")
_IN_SPACE = ("tip_x", "tip_y", "tip_z", "bend_ulnar", "bend_flexion")
# Names of those columns, and of further inputs, in an open log.
_NAMES = {"bend_y": "theta", "mass": "hand_mass"}
_NAMES_IN_SPACE = {"bend_y": "bend_ulnar", "bend_z": "bend_flexion", "mass": "hand_mass"}
_EXAMPLE = "tip_x [mm],tip_y [mm],angle [deg]"
_FEWEST = 10


@dataclass(frozen=True)
class RecordedCourse:
    """T samples of one recording; SI units."""

    name: str
    tip: Array
    """(T, P + 1)"""
    theta: Array
    """(T,), in two planes (T, 2)"""
    others: Mapping[str, Array]
    """inputs after x and y, keys of `learning.domain.OTHERS`"""
    left_out: int = 0
    """Rows of the recording that miss a tip, an angle or an input."""


def courses_in(columns: Mapping[str, Any], name: str) -> Iterator[RecordedCourse]:
    """The courses in columns of SI units, none without tips and angles; rows that miss any value are left out.

    One may have no samples: all its rows were left out. A column `trial` parts them; of arrays (rows, T) each row is
    one.
    """
    found = next((needed for needed in (_IN_SPACE, NEEDED) if all(column in columns for column in needed)), None)
    if found is None:
        return
    planes = len(found) // 2
    arrays = {column: np.asarray(columns[column], np.float64) for column in (*found, *OTHERS) if column in columns}
    shape = arrays[found[-1]].shape
    if "trial" in columns and len(shape) == 1:
        whose = np.asarray(columns["trial"])
        parts = [(f"{name}, trial {_label(number)}", whose == number) for number in dict.fromkeys(whose.tolist())]
    else:
        rows = range(shape[0]) if len(shape) == 2 else (slice(None),)
        parts = [(name, np.index_exp[row]) for row in rows]
    for label, rows in parts:
        values = {key: np.broadcast_to(array, shape)[rows].ravel() for key, array in arrays.items()}
        finite = np.isfinite(np.stack(list(values.values()))).all(axis=0)
        kept = {key: array[finite] for key, array in values.items()}
        tip, bends = (np.column_stack([kept[key] for key in part]) for part in np.split(found, [planes + 1]))
        others = {key: kept[key] for key in OTHERS if key in kept}
        theta = bends[:, 0] if planes == 1 else bends
        yield RecordedCourse(label, tip, theta, others, int(np.sum(~finite)))


def _label(trial: str | float) -> str:
    try:
        return f"{float(trial):g}"
    except ValueError:
        return str(trial)


def read_courses(file: Path, names: str = "") -> list[RecordedCourse]:
    """The recordings in an open log. Raises UserError with line and column for what is none.

    `names` are another author's columns as `wristctl.records.open_log` has them. Samples without a tip or an angle are
    left out.
    """
    log = telling(looked_at(read_log(file, names, "measured data"), motion=False))
    bends = log.bends()
    if bends is not None:
        log = replace(log, columns={**log.columns, "bend_y": bends[:, 0], "bend_z": bends[:, 1]})
    for name in ("tip_x", "tip_y", "bend_y"):
        if name not in log.columns:
            log.whole(name, _EXAMPLE)
    names_of = _NAMES_IN_SPACE if {"tip_z", "bend_z"} <= set(log.columns) else _NAMES
    columns: dict[str, Any] = {names_of.get(name, name): column for name, column in log.columns.items()}
    columns.update(log.words)
    size = np.hypot(columns["bend_ulnar"], columns["bend_flexion"]) if "bend_flexion" in columns else columns["theta"]
    off = np.flatnonzero(np.abs(size) > np.pi)
    if off.size:
        problem = f"an angle of {np.rad2deg(size[off[0]]):.4g} deg"
        raise UserError(problem, log.at(int(off[0])), "put the angle's unit into the header")
    return list(courses_in(columns, file.name))


def samples_of_courses(courses: Sequence[RecordedCourse], count: int | None, rng: np.random.Generator) -> Samples:
    """Samples of recordings, all or at most `count`. Raises UserError where too few are known, or inputs differ."""
    if len({course.tip.shape[1] for course in courses}) > 1:
        odd = next(course for course in courses if course.tip.shape[1] != courses[0].tip.shape[1])
        raise UserError("some recordings bend in one plane, others in two", odd.name, "a data set of each")
    names = [tuple(course.others) for course in courses]
    if len(set(names)) > 1:
        odd = next(course for course, inputs in zip(courses, names, strict=True) if inputs != names[0])
        unusual, usual = (", ".join(inputs) or "none" for inputs in (odd.others, names[0]))
        problem = f"inputs {unusual} beside the tip, where others have {usual}"
        raise UserError(problem, odd.name, "the same columns in each recording")
    total = sum(len(course.theta) for course in courses)
    if total < _FEWEST:
        raise UserError(
            f"{total} sample{'s are' if total != 1 else ' is'} known",
            "gen-data",
            f"at least {_FEWEST}: name longer recordings",
        )
    rows = np.sort(rng.choice(total, total if count is None else min(count, total), replace=False))
    tip, theta = (np.concatenate([getattr(course, name) for course in courses])[rows] for name in ("tip", "theta"))
    columns = [np.concatenate([course.others[key] for course in courses])[rows] for key in names[0]]
    inputs = np.column_stack(columns) if columns else np.empty((len(theta), 0))
    recording = np.repeat(np.arange(len(courses)), [len(course.theta) for course in courses])[rows]
    held, arc = np.zeros(len(theta), np.int64), arc_to(tip)[1]
    return Samples(tip, theta, arc, Domain.around(tip, inputs), inputs, names[0], held, 1, recording)
