"""Tables of circles: the lag behind a wrist without friction, the size that is left, and works, of a turn each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase

_OF_A_CIRCLE = {
    "friction": ("", "coefficient of the tendons' friction"),
    "sheath": ("rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    "presliding": ("m", "path in which friction turns round"),
    "frequency": ("1/s", "turns per second"),
    "radius": ("rad", "bend without friction"),
    "lag": ("rad", "mean distance along the circle by which the bend comes behind that without friction"),
    "narrower": ("rad", "mean bend less than that without friction"),
    "friction_work": ("J", "what friction took in a turn"),
    "raw_work": ("J", "what the spools gave in a turn"),
    "damped_work": ("J", "what the wrist's damping took in a turn"),
    "step": ("s", "integration step that it took"),
    "drift": ("", "largest relative change of lag, size and works with the step, at the shortest tried; 0: converged"),
}
_OF_A_COURSE = {
    "circle": ("", "row of circles.csv, from 0"),
    "time": ("s", "since the turn began"),
    "unhindered_ulnar": ("rad", "bend toward ulnar without friction on these spools"),
    "unhindered_flexion": ("rad", "and toward flexion"),
    "bend_ulnar": ("rad", "bend toward ulnar"),
    "bend_flexion": ("rad", "bend toward flexion"),
}


def in_um(case: FrictionCase) -> tuple[float, float, float]:
    """Coefficient, sheath [rad] and presliding [um] of a friction."""
    return case.friction, case.sheath, 1e6 * case.presliding


def fate_of(item: HysteresisLoop | DeadBand | HysteresisCircle) -> str:
    """Remaining change with the integration step, as text. Empty where there is none."""
    if item.drift == 0.0:
        return ""
    by = f"by {100.0 * item.drift:.2g} % " if math.isfinite(item.drift) else ""
    return f"NOT CONVERGED: changes {by}with the integration step"


def circle_tables(around: Sequence[HysteresisCircle]) -> list[Table]:
    """A table with a row for each circle; none without circles."""
    if not around:
        return []
    fate = ("fate",) * any(circle.drift > 0.0 for circle in around)
    heads = ("friction", "sheath [rad]", "presliding [um]", "bend [deg]", "frequency [Hz]", "behind [deg]",
             "less bent [deg]", "friction [mJ]", "damping [mJ]", "step [ms]", *fate)  # fmt: skip
    rows = [
        (*in_um(circle.case.tendons), math.degrees(circle.case.radius), circle.case.frequency,
         math.degrees(circle.lag), math.degrees(circle.narrower), 1e3 * circle.friction_work, 1e3 * circle.damped_work,
         1e3 * circle.step, *(fate_of(circle),) * len(fate))
        for circle in around
    ]  # fmt: skip
    return [Table("Circles about the straight wrist, a turn each", heads, rows)]


def write_circles(findings: Findings, around: Sequence[HysteresisCircle]) -> None:
    """Keep circles and their courses, where there are any."""
    import numpy as np
    import pandas as pd

    if not around:
        return
    rows = [
        circle.case.tendons._asdict()
        | circle.case._asdict()
        | {name: getattr(circle, name) for name in _OF_A_CIRCLE if hasattr(circle, name)}
        for circle in around
    ]
    courses = [
        np.column_stack([np.full(len(each.time), number), each.time, each.unhindered, each.course.bends])
        for number, each in enumerate(around)
    ]
    frames = pd.DataFrame(rows)[list(_OF_A_CIRCLE)], pd.DataFrame(np.concatenate(courses), columns=list(_OF_A_COURSE))
    for name, frame, columns in zip(("circles", "circle_courses"), frames, (_OF_A_CIRCLE, _OF_A_COURSE), strict=True):
        units = {column: unit for column, (unit, _) in columns.items()}
        meanings = {column: meaning for column, (_, meaning) in columns.items()}
        findings.table(f"data/{name}.csv", frame, units, meanings)
