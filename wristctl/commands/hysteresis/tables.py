"""Loops, dead bands and circles as tables and files: each quantity with its unit and meaning in one place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from wristctl.commands.printed_table import Table
from wristctl.commands.quantities import Quantity, documented, table_of
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.arrays import Array
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase

    Driven: TypeAlias = HysteresisLoop | DeadBand | HysteresisCircle

_FRICTION = (
    Quantity("friction", "", "coefficient of the tendons' friction"),
    Quantity("sheath", "rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    Quantity("presliding", "m", "path in which friction turns round", shown="um"),
)
_STEP = Quantity("step", "s", "integration step that it took", shown="ms")
_WORKS = (
    Quantity(
        "friction_work", "J", "what friction took in a cycle: pull at the spool less pull at the wrist, along the path",
        "friction", "mJ",
    ),
    Quantity("raw_work", "J", "area of the loop of pulls at the spools along the path", "raw loop", "mJ"),
    Quantity("damped_work", "J", "what the wrist's damping took in a cycle", "damping", "mJ"),
)  # fmt: skip


def _drift(what: str) -> Quantity:
    return Quantity("drift", "", f"largest {what} with the step, at the shortest tried; 0: converged")


LOOPS = (
    *_FRICTION,
    Quantity("frequency", "1/s", "cycles per second", shown="Hz"),
    Quantity("low", "rad", "angle without friction at one end"),
    Quantity("high", "rad", "and at the other"),
    Quantity("width", "rad", "by how much more it is bent on its way back, in the middle of the range"),
    Quantity("exact_width", "rad", "dead band there, by the roots of the statics", "statics"),
    *_WORKS,
    _STEP,
    _drift("relative change of width and works"),
)  # fmt: skip
_BANDS = (
    *_FRICTION,
    Quantity("unhindered", "rad", "angle without friction", "angle"),
    Quantity("exact_below", "rad", "rest from below by the statics"),
    Quantity("exact_above", "rad", "rest from above by the statics"),
    Quantity("below", "rad", "rest after a ramp from below"),
    Quantity("above", "rad", "rest after a ramp from above"),
    Quantity("slid", "", "whether tendons slid far enough on both ramps to bend their bristles fully", "slid fully"),
    _STEP,
    Quantity(
        "drift", "", "largest change of a rest with the step, over the width, at the shortest tried; 0: converged"
    ),
)
_OF_BANDS = (Quantity("width", "rad", heading="dead band"), Quantity("exact_width", "rad", heading="statics"))
_CIRCLES = (
    *_FRICTION,
    Quantity("frequency", "1/s", "turns per second", shown="Hz"),
    Quantity("radius", "rad", "bend without friction", "bend"),
    Quantity("lag", "rad", "mean distance along the circle by which it comes behind that without friction", "behind"),
    Quantity("narrower", "rad", "mean bend less than that without friction", "less bent"),
    Quantity("friction_work", "J", "what friction took in a turn", "friction", "mJ"),
    Quantity("raw_work", "J", "what the spools gave in a turn", "raw work", "mJ"),
    Quantity("damped_work", "J", "what the wrist's damping took in a turn", "damping", "mJ"),
    _STEP,
    _drift("relative change of lag, size and works"),
)  # fmt: skip
_FATE = Quantity("fate")
_SIDES = (
    Quantity("given", "m", "what the {} has reeled in"),
    Quantity("spool", "N", "pull of all its tendons at the spool, of the {}"),
    Quantity("wrist", "N", "pull of all its tendons at the wrist, of the {}"),
    Quantity("z", "", "state of the {}'s bristle"),
)
_BENDS = (Quantity("bend_ulnar", "rad", "bend toward ulnar"), Quantity("bend_flexion", "rad", "bend toward flexion"))
_COURSES = (
    Quantity("loop", "", "row of loops.csv, from 0"),
    Quantity("time", "s", "since the range's high end"),
    Quantity("unhindered", "rad", "angle without friction on these spools"),
    Quantity("theta", "rad", "angle, of two planes along the direction of the loop"),
    *_BENDS,
)
_CIRCLE_COURSES = (
    Quantity("circle", "", "row of circles.csv, from 0"),
    Quantity("time", "s", "since the turn began"),
    Quantity("unhindered_ulnar", "rad", "bend toward ulnar without friction on these spools"),
    Quantity("unhindered_flexion", "rad", "and toward flexion"),
    *_BENDS,
)
# Loops and dead bands that are all printed; of more, those with the main path of presliding, all being in data.
_MOST = 60


def record_of(driven: Driven) -> dict[str, Any]:
    """Its friction, how it was driven, and what came of it, by the quantities' names."""
    case = getattr(driven, "case", None)
    tendons: FrictionCase = driven.tendons if case is None else case.tendons  # type: ignore[union-attr]
    own = {*LOOPS, *_BANDS, *_OF_BANDS, *_CIRCLES}
    found = {quantity.name: getattr(driven, quantity.name) for quantity in own if hasattr(driven, quantity.name)}
    return tendons._asdict() | ({} if case is None else case._asdict()) | found | {"fate": _fate(driven)}


def _fate(driven: Driven) -> str:
    """Remaining change with the integration step, as text. Empty where there is none."""
    if driven.drift == 0.0:
        return ""
    by = f"by {100.0 * driven.drift:.2g} % " if math.isfinite(driven.drift) else ""
    return f"NOT CONVERGED: changes {by}with the integration step"


def still_change(every: Iterable[Driven]) -> int:
    """Number of loops, dead bands and circles that change with the integration step."""
    return sum(driven.drift > 0.0 for driven in every)


def frame_of(quantities: Sequence[Quantity], every: Iterable[Driven]) -> pd.DataFrame:
    """One row for each loop, dead band or circle."""
    import pandas as pd

    return pd.DataFrame([record_of(driven) for driven in every], columns=[quantity.name for quantity in quantities])


def tables_of(
    driven: Sequence[HysteresisLoop], bands: Sequence[DeadBand], around: Sequence[HysteresisCircle], main: FrictionCase
) -> list[Table]:
    """The loops over the first range, the dead bands and the circles."""
    first, many = driven[0].case, len(driven) + len(bands) > _MOST
    outer = [loop for loop in driven if (loop.case.low, loop.case.high) == (first.low, first.high)]
    chosen = [loop for loop in outer if not many or loop.case.tendons.presliding == main.presliding]
    rests = [band for band in bands if not many or band.tendons.presliding == main.presliding]
    held = [quantity for quantity in _BANDS if quantity.name in ("unhindered", "slid")]
    shown: list[tuple[str, Sequence[Driven], Sequence[Quantity]]] = [
        ("Loops over the first range", chosen, [each for each in LOOPS if each.name not in ("low", "high", "drift")]),
        ("Where ramps leave the wrist", rests, [*_FRICTION, held[0], *_OF_BANDS, held[1], _STEP]),
        ("Circles about the straight wrist, a turn each", around, _CIRCLES[:-1]),
    ]
    tables = []
    for title, every, quantities in shown:
        fate = [_FATE] * bool(still_change(every))
        if every:
            tables.append(table_of(title, [*quantities, *fate], map(record_of, every)))
    return tables


def write(
    findings: Findings, driven: Sequence[HysteresisLoop], bands: Sequence[DeadBand], around: Sequence[HysteresisCircle]
) -> None:
    """Keep loops, dead bands and circles, and the courses of loops and circles."""
    import numpy as np
    import pandas as pd

    files: list[tuple[str, Sequence[Quantity], Sequence[Driven]]] = [
        ("loops", LOOPS, driven), ("dead_bands", _BANDS, bands), ("circles", _CIRCLES, around),
    ]  # fmt: skip
    for name, quantities, every in files:
        if every:
            findings.table(f"data/{name}.csv", frame_of(quantities, every), *documented(quantities))
    courses = [_course(number, loop) for number, loop in enumerate(driven)]
    columns = {name: np.concatenate([course[name] for course in courses]) for name in courses[0]}
    findings.table("data/courses.csv", columns, *documented(map(_of_course, columns)))
    if around:
        turns = [
            np.column_stack([np.full(len(each.time), number), each.time, each.unhindered, each.course.bends])
            for number, each in enumerate(around)
        ]
        names = [quantity.name for quantity in _CIRCLE_COURSES]
        whole = pd.DataFrame(np.concatenate(turns), columns=names)
        findings.table("data/circle_courses.csv", whole, *documented(_CIRCLE_COURSES))


def _course(number: int, loop: HysteresisLoop) -> dict[str, Array]:
    """Courses of a loop by their names: of both sides in one plane, of each plane and each place in two."""
    import numpy as np

    course, two = loop.course, len(loop.toward) == 2
    columns = {"loop": np.full(len(loop.time), number), "time": loop.time, "unhindered": loop.unhindered}
    columns["theta"] = loop.bend
    if two:
        columns |= dict(zip(("bend_ulnar", "bend_flexion"), course.bends.T, strict=True))
    names = [str(place) for place in range(1, course.spool.shape[1] + 1)] if two else ["plus", "minus"]
    for quantity in _SIDES:
        values = getattr(course, quantity.name).T
        columns |= {f"{quantity.name}_{name}": column for name, column in zip(names, values, strict=True)}
    return columns


def _of_course(column: str) -> Quantity:
    """The quantity of a column of courses: one of the loop, or of a side's or a place's tendons."""
    for quantity in _COURSES:
        if quantity.name == column:
            return quantity
    kind, _, place = column.partition("_")
    side = {"plus": "+ side", "minus": "- side"}.get(place, f"place {place}")
    of_place = next(quantity for quantity in _SIDES if quantity.name == kind)
    return Quantity(column, of_place.unit, of_place.meaning.format(side))
