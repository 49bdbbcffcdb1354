"""Loops, dead bands and circles of a wrist as rows and columns: each quantity with its unit in one place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

from wristctl.commands.quantities import Quantity

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.arrays import Array
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase

    Driven: TypeAlias = HysteresisLoop | DeadBand | HysteresisCircle

FRICTION = (
    Quantity("friction", "", "coefficient of the tendons' friction"),
    Quantity("sheath", "rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    Quantity("presliding", "m", "path in which friction turns round", shown="um"),
)
STEP = Quantity("step", "s", "integration step that it took", shown="ms")
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
    *FRICTION,
    Quantity("frequency", "1/s", "cycles per second", shown="Hz"),
    Quantity("low", "rad", "angle without friction at one end"),
    Quantity("high", "rad", "and at the other"),
    Quantity("width", "rad", "by how much more it is bent on its way back, in the middle of the range"),
    Quantity("exact_width", "rad", "dead band there, by the roots of the statics", "statics"),
    *_WORKS,
    STEP,
    _drift("relative change of width and works"),
)  # fmt: skip
BANDS = (
    *FRICTION,
    Quantity("unhindered", "rad", "angle without friction", "angle"),
    Quantity("exact_below", "rad", "rest from below by the statics"),
    Quantity("exact_above", "rad", "rest from above by the statics"),
    Quantity("below", "rad", "rest after a ramp from below"),
    Quantity("above", "rad", "rest after a ramp from above"),
    Quantity("slid", "", "whether tendons slid far enough on both ramps to bend their bristles fully", "slid fully"),
    STEP,
    Quantity(
        "drift", "", "largest change of a rest with the step, over the width, at the shortest tried; 0: converged"
    ),
)
OF_BANDS = (Quantity("width", "rad", heading="dead band"), Quantity("exact_width", "rad", heading="statics"))
CIRCLES = (
    *FRICTION,
    Quantity("frequency", "1/s", "turns per second", shown="Hz"),
    Quantity("radius", "rad", "bend without friction", "bend"),
    Quantity("lag", "rad", "mean distance along the circle by which it comes behind that without friction", "behind"),
    Quantity("narrower", "rad", "mean bend less than that without friction", "less bent"),
    Quantity("friction_work", "J", "what friction took in a turn", "friction", "mJ"),
    Quantity("raw_work", "J", "what the spools gave in a turn", "raw work", "mJ"),
    Quantity("damped_work", "J", "what the wrist's damping took in a turn", "damping", "mJ"),
    STEP,
    _drift("relative change of lag, size and works"),
)  # fmt: skip
FATE = Quantity("fate")
_SIDES = (
    Quantity("given", "m", "what the {} has reeled in"),
    Quantity("spool", "N", "pull of all its tendons at the spool, of the {}"),
    Quantity("wrist", "N", "pull of all its tendons at the wrist, of the {}"),
    Quantity("z", "", "state of the {}'s bristle"),
)
_OF_SIDES = {"plus": "+ side", "minus": "- side"}
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


def outer(loops: Sequence[HysteresisLoop]) -> list[HysteresisLoop]:
    """The loops over the first range."""
    first = loops[0].case
    return [loop for loop in loops if (loop.case.low, loop.case.high) == (first.low, first.high)]


def by_speed(loops: Sequence[HysteresisLoop], tendons: FrictionCase) -> list[HysteresisLoop]:
    """Those of a friction, the slowest first."""
    return sorted((loop for loop in outer(loops) if loop.case.tendons == tendons), key=lambda each: each.case.frequency)


def middle_band(bands: Iterable[DeadBand], tendons: FrictionCase) -> DeadBand | None:
    """The dead band of a friction at the middle one of the angles; None without any."""
    own = [band for band in bands if band.tendons == tendons]
    return own[len(own) // 2] if own else None


def record_of(driven: Driven) -> dict[str, Any]:
    """Its friction, how it was driven, and what came of it, by the quantities' names."""
    case = getattr(driven, "case", None)
    tendons: FrictionCase = driven.tendons if case is None else case.tendons  # type: ignore[union-attr]
    own = {*LOOPS, *BANDS, *OF_BANDS, *CIRCLES}
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


def turn_of(number: int, circle: HysteresisCircle) -> dict[Quantity, Array]:
    """Courses of a circle."""
    import numpy as np

    columns = (np.full(len(circle.time), float(number)), circle.time, *circle.unhindered.T, *circle.course.bends.T)
    return dict(zip(_CIRCLE_COURSES, columns, strict=True))


def course_of(number: int, loop: HysteresisLoop) -> dict[Quantity, Array]:
    """Courses of a loop: of both sides in one plane, of each plane and each place in two."""
    import numpy as np

    course, two = loop.course, len(loop.toward) == 2
    values = [np.full(len(loop.time), number), loop.time, loop.unhindered, loop.bend, *(course.bends.T if two else ())]
    columns = dict(zip(_COURSES, values, strict=False))
    places = {str(place): f"place {place}" for place in range(1, course.spool.shape[1] + 1)}
    for quantity in _SIDES:
        alike = zip((places if two else _OF_SIDES).items(), getattr(course, quantity.name).T, strict=True)
        for (name, words), column in alike:
            meaning = quantity.meaning.format(words)
            columns[replace(quantity, name=f"{quantity.name}_{name}", meaning=meaning)] = column
    return columns
