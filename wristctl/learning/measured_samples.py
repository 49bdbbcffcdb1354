"""Samples that were measured: tips and angles of recordings, from tables of runs or from CSV files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.domain import OTHERS, Domain
from wristctl.records.log_converters import read_log
from wristctl.wrist.kinematics import exact_arc

# Columns of a table of a run that hold a course.
NEEDED = ("tip_x", "tip_y", "theta")
# Names of those columns, and of further inputs, in an open log.
_NAMES = {"bend_y": "theta", "mass": "hand_mass"}
_EXAMPLE = "tip_x [mm],tip_y [mm],angle [deg]"
_FEWEST = 10


@dataclass(frozen=True)
class RecordedCourse:
    """T samples of one recording; SI units."""

    name: str
    tip: Array
    """(T, 2)"""
    theta: Array
    others: Mapping[str, Array]
    """inputs after x and y, keys of `learning.domain.OTHERS`"""
    left_out: int = 0
    """Rows of the recording that miss a tip, an angle or an input."""


def courses_in(columns: Mapping[str, Any], name: str) -> Iterator[RecordedCourse]:
    """The courses in columns of SI units, none without tips and angles; rows that miss any value are left out.

    One may have no samples: all its rows were left out. A column `trial` parts them; of arrays (rows, T) each row is
    one.
    """
    if not all(column in columns for column in NEEDED):
        return
    arrays = {column: np.asarray(columns[column], np.float64) for column in (*NEEDED, *OTHERS) if column in columns}
    shape = arrays["theta"].shape
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
        tip = np.column_stack([kept["tip_x"], kept["tip_y"]])
        others = {key: kept[key] for key in OTHERS if key in kept}
        yield RecordedCourse(label, tip, kept["theta"], others, int(np.sum(~finite)))


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
    log = read_log(file, names, "measured data")
    bends = log.bends()
    if bends is not None:
        log = replace(log, columns={**log.columns, "bend_y": bends[:, 0]})
    for name in ("tip_x", "tip_y", "bend_y"):
        if name not in log.columns:
            log.whole(name, _EXAMPLE)
    columns: dict[str, Any] = {_NAMES.get(name, name): column for name, column in log.columns.items()}
    columns.update(log.words)
    off = np.flatnonzero(np.abs(columns["theta"]) > np.pi)
    if off.size:
        problem = f"an angle of {np.rad2deg(columns['theta'][off[0]]):.4g} deg"
        raise UserError(problem, log.at(int(off[0])), "put the angle's unit into the header")
    return list(courses_in(columns, file.name))


def samples_of_courses(courses: Sequence[RecordedCourse], count: int | None, rng: np.random.Generator) -> Samples:
    """Samples of recordings, all or at most `count`. Raises UserError where too few are known, or inputs differ."""
    names = [tuple(course.others) for course in courses]
    if len(set(names)) > 1:
        odd = next(course for course, inputs in zip(courses, names, strict=True) if inputs != names[0])
        unusual, usual = (", ".join(inputs) or "none" for inputs in (odd.others, names[0]))
        problem = f"inputs {unusual} beside the tip, where others have {usual}"
        raise UserError(problem, odd.name, "the same columns in each recording")
    total = sum(len(course.theta) for course in courses)
    if total < _FEWEST:
        raise UserError(f"{total} samples are known", "gen-data", f"at least {_FEWEST}: name longer recordings")
    rows = np.sort(rng.choice(total, total if count is None else min(count, total), replace=False))
    tip, theta = (np.concatenate([getattr(course, name) for course in courses])[rows] for name in ("tip", "theta"))
    columns = [np.concatenate([course.others[key] for course in courses])[rows] for key in names[0]]
    inputs = np.stack(columns or [theta], -1)
    inputs = inputs[:, : len(names[0])]
    recording = np.repeat(np.arange(len(courses)), [len(course.theta) for course in courses])[rows]
    held, arc = np.zeros(len(theta), np.int64), exact_arc(tip)[1]
    return Samples(tip, theta, arc, Domain.around(tip, inputs), inputs, names[0], held, 1, recording)
