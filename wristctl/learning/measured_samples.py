"""Samples that were measured: tips and angles of recordings, from tables of runs or from CSV files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.domain import OTHERS, Domain
from wristctl.records.measured_table import ANGLE, LENGTH, NUMBER, TIME, Expected
from wristctl.wrist.kinematics import exact_arc

NEEDED = ("tip_x", "tip_y", "theta")
"""Columns of a table of a run that hold a course."""
_NAMES = {"x": "tip_x", "y": "tip_y", "angle": "theta"}
"""What people call them."""
_PLACES = {"tip_x": LENGTH, "tip_y": LENGTH, "x": LENGTH, "y": LENGTH}
DATA = Expected(
    "measured data",
    {
        **_PLACES,
        "angle": ANGLE,
        "theta": ANGLE,
        "pose": ANGLE,
        "hand_mass": {"kg": 1.0, "g": 1e-3},
        "trial": NUMBER,
        "time": TIME,
    },
    needed=(),
    example="tip_x [mm],tip_y [mm],angle [deg]",
)
_FEWEST = 10


@dataclass(frozen=True)
class RecordedCourse:
    """T samples of one recording; SI units."""

    name: str
    tip: Array
    """(T, 2)"""
    theta: Array
    others: Mapping[str, Array]
    """of the inputs after x and y, keys of `learning.domain.OTHERS`"""


def courses_in(columns: Mapping[str, Any], name: str) -> Iterator[RecordedCourse]:
    """The courses in columns of SI units, none without tips and angles; rows that miss any value are left out.

    A column `trial` parts them; of arrays (rows, T) each row is one.
    """
    if not all(each in columns for each in NEEDED):
        return
    arrays = {each: np.asarray(columns[each], np.float64) for each in (*NEEDED, *OTHERS) if each in columns}
    shape = arrays["theta"].shape
    if "trial" in columns and len(shape) == 1:
        whose = np.asarray(columns["trial"])
        parts = [(f"{name}, trial {number:g}", whose == number) for number in np.unique(whose)]
    else:
        rows = range(shape[0]) if len(shape) == 2 else (slice(None),)
        parts = [(name, np.index_exp[row]) for row in rows]
    for label, rows in parts:
        own = {key: np.broadcast_to(each, shape)[rows].ravel() for key, each in arrays.items()}
        known = np.isfinite(np.stack(list(own.values()))).all(axis=0)
        if known.any():
            kept = {key: each[known] for key, each in own.items()}
            tip = np.column_stack([kept["tip_x"], kept["tip_y"]])
            yield RecordedCourse(label, tip, kept["theta"], {key: kept[key] for key in OTHERS if key in kept})


def read_courses(file: Path) -> list[RecordedCourse]:
    """The recordings in a CSV file whose header has units. Raises UserError with line and column for what is none."""
    table = DATA.read(file)
    columns = {_NAMES.get(name, name): each for name, each in table.columns.items()}
    if len(columns) < len(table.columns):
        raise UserError("the same column under two names", f"{file}:1", "leave one out")
    for name in NEEDED:
        if name not in columns:
            raise UserError(f"no column {name}", str(file), f"a header such as {DATA.example}")
    off = np.flatnonzero(np.abs(columns["theta"]) > np.pi)
    if off.size:
        told = f"an angle of {np.rad2deg(columns['theta'][off[0]]):.4g} deg"
        raise UserError(told, table.at(int(off[0])), "put the angle's unit into the header")
    return list(courses_in(columns, file.name))


def samples_of_courses(courses: Sequence[RecordedCourse], count: int, rng: np.random.Generator) -> Samples:
    """At most `count` samples of recordings. Raises UserError where too few are known, or inputs differ."""
    names = [tuple(course.others) for course in courses]
    if len(set(names)) > 1:
        odd = next(course for course, own in zip(courses, names, strict=True) if own != names[0])
        own, usual = (", ".join(each) or "none" for each in (odd.others, names[0]))
        what = f"inputs {own} beside the tip, where others have {usual}"
        raise UserError(what, odd.name, "the same columns in each recording")
    whole = sum(len(course.theta) for course in courses)
    if whole < _FEWEST:
        raise UserError(f"{whole} samples are known", "gen-data", f"at least {_FEWEST}: name longer recordings")
    rows = np.sort(rng.choice(whole, min(count, whole), replace=False))
    tip, theta = np.concatenate([each.tip for each in courses])[rows], np.concatenate([c.theta for c in courses])[rows]
    others = np.stack([np.concatenate([each.others[key] for each in courses])[rows] for key in names[0]] or [theta], -1)
    others = others[:, : len(names[0])]
    recording = np.repeat(np.arange(len(courses)), [len(each.theta) for each in courses])[rows]
    held, arc = np.zeros(len(theta), np.int64), exact_arc(tip)[1]
    return Samples(tip, theta, arc, Domain.around(tip, others), others, names[0], held, 1, recording)
