"""Hysteresis of a wrist as a result: its answer, its tables and files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.analyse.hysteresis_tables import (
    BANDS,
    CIRCLES,
    FATE,
    FRICTION,
    LOOPS,
    OF_BANDS,
    STEP,
    by_speed,
    course_of,
    frame_of,
    middle_band,
    outer,
    record_of,
    still_change,
    turn_of,
)
from wristctl.commands.answer import Answer, rest
from wristctl.commands.printed_table import Table, degrees, two
from wristctl.commands.quantities import Quantity, documented, table_of
from wristctl.commands.results import StudyResult
from wristctl.wrist.directions import toward_words

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.arrays import Array
    from wristctl.commands.analyse.hysteresis_tables import Driven
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase

# Loops and dead bands that are all printed; of more, those with the main path of presliding, all being in data.
_MOST = 60
_NOT_CONVERGED = "loops, dead bands and circles that still change with the integration step"
# Rows that a table may have; of more, those of the main coefficient of friction.
_ROWS = 14
# Quantities of a row beside its dead band.
_OF_A_ROW = ("friction", "sheath", "width", "friction_work", "damped_work")


@dataclass(frozen=True, repr=False, eq=False)
class Hysteresis(StudyResult):
    """Loops of a wrist on its tendons without a controller, the dead band, and circles in two planes."""

    kind = "analyse"

    loops: list[HysteresisLoop]
    dead_bands: list[DeadBand]
    circles: list[HysteresisCircle]

    @property
    def answer(self) -> Answer:
        """The dead band and loops of the wrist at its main friction, beside other coefficients and sheaths."""
        return _answer(self)

    @property
    def every(self) -> list[Driven]:
        """Loops, dead bands and circles."""
        return [*self.loops, *self.dead_bands, *self.circles]

    @property
    def main(self) -> FrictionCase:
        """The friction that words are about."""
        from wristctl.simulation.hysteresis import main_case

        return main_case(self.study.hysteresis)

    @property
    def marks(self) -> list[str]:
        """Number of loops, dead bands and circles that still change with the integration step."""
        open_ = still_change(self.every)
        return [f"not converged: {open_} of {len(self.every)}"] * bool(open_)

    def frame(self) -> pd.DataFrame:
        """One row per loop: friction, speed, range, the dead band in its middle, and works; SI units."""
        return frame_of(LOOPS, self.loops)


def _answer(found: Hysteresis) -> Answer:
    """Dead band, width and works of the wrist at its main friction, beside other coefficients and sheaths."""
    from wristctl.simulation.strokes import why_in_two_planes

    main, loops = found.main, outer(found.loops)
    slowest = min(loop.case.frequency for loop in loops)
    slow = [loop for loop in loops if loop.case.frequency == slowest]
    own = next(loop for loop in slow if loop.case.tendons == main)
    rows = [loop for loop in slow if loop.case.tendons.presliding == main.presliding]
    if len(rows) > _ROWS:
        rows = [loop for loop in rows if loop.case.tendons.friction == main.friction][:_ROWS]
    quantities = [quantity for quantity in LOOPS if quantity.name in _OF_A_ROW]
    quantities.insert(2, Quantity("dead_band", "rad"))
    held = [middle_band(found.dead_bands, loop.case.tendons) for loop in rows]
    records = [
        record_of(loop) | {"dead_band": band.width if band else None} for loop, band in zip(rows, held, strict=True)
    ]
    notes = [f"Width and works are of a cycle at {slowest:g} Hz, with a presliding of {1e6 * main.presliding:g} um."]
    if open_ := still_change(found.every):
        parts = "loops, dead bands and circles" if found.circles else "loops and dead bands"
        notes.append(f"Do not rely on all of them: {open_} of {len(found.every)} {parts} have not converged (--all).")
    if slow_circles := [circle for circle in found.circles if circle.case.tendons == main]:
        circle = min(slow_circles, key=lambda each: each.case.frequency)
        notes.append(
            f"On a circle of {math.degrees(circle.case.radius):g} deg at {circle.case.frequency:g} Hz it comes "
            f"{degrees(circle.lag, 3)} deg behind, and friction takes {two(1e3 * circle.friction_work, 3)} mJ a turn."
        )
    if why_two := why_in_two_planes(found.study.wrist, found.study.hysteresis):
        toward = math.degrees(math.atan2(own.toward[1], own.toward[0])) % 360.0
        aside = f"friction takes the wrist off that line by {degrees(own.aside, 3)} deg at most"
        notes.append(f"In two planes ({why_two}), bent {toward_words(toward)}; {aside}.")
    sentence = _of_wrist(own, middle_band(found.dead_bands, main))
    return Answer(sentence, table_of("", quantities, records), notes, rest("Every loop", found.place))


def _of_wrist(loop: HysteresisLoop, band: DeadBand | None) -> str:
    case = loop.case
    sheath = f"{case.tendons.sheath:g} rad ({math.degrees(case.tendons.sheath):.3g} deg)"
    begin = f"With a friction coefficient of {case.tendons.friction:g} and a sheath of {sheath}"
    if band is not None:
        dead = f"the dead band is {degrees(band.width, 3)} deg at {math.degrees(band.unhindered):g} deg"
        begin += f" {dead}, and"
    swing = f"{math.degrees(case.low):g} to {math.degrees(case.high):g} deg"
    width = f"the wrist is bent by {degrees(abs(loop.width), 3)} deg more on its way back"
    return f"{begin} {width}. Friction takes {two(1e3 * loop.friction_work, 3)} mJ in a cycle of {swing}."


def tables_of(found: Hysteresis) -> list[Table]:
    """The loops over the first range, the dead bands and the circles."""
    many, main = len(found.loops) + len(found.dead_bands) > _MOST, found.main
    chosen = [loop for loop in outer(found.loops) if not many or loop.case.tendons.presliding == main.presliding]
    rests = [band for band in found.dead_bands if not many or band.tendons.presliding == main.presliding]
    held = [quantity for quantity in BANDS if quantity.name in ("unhindered", "slid")]
    shown: list[tuple[str, Sequence[Driven], Sequence[Quantity]]] = [
        ("Loops over the first range", chosen, [each for each in LOOPS if each.name not in ("low", "high", "drift")]),
        ("Where ramps leave the wrist", rests, [*FRICTION, held[0], *OF_BANDS, held[1], STEP]),
        ("Circles about the straight wrist, a turn each", found.circles, CIRCLES[:-1]),
    ]
    return [
        table_of(title, [*quantities, *[FATE] * bool(still_change(every))], map(record_of, every))
        for title, every, quantities in shown
        if every
    ]


def write(found: Hysteresis) -> None:
    """Keep the numbers of the main friction, and loops, dead bands and circles with their courses."""
    _keep_metrics(found)
    files: list[tuple[str, Sequence[Quantity], Sequence[Driven]]] = [
        ("loops", LOOPS, found.loops), ("dead_bands", BANDS, found.dead_bands), ("circles", CIRCLES, found.circles),
    ]  # fmt: skip
    for name, quantities, every in files:
        if every:
            found.findings.table(f"data/{name}.csv", frame_of(quantities, every), *documented(quantities))
    _keep_courses(found, "courses", [course_of(number, loop) for number, loop in enumerate(found.loops)])
    _keep_courses(found, "circle_courses", [turn_of(number, circle) for number, circle in enumerate(found.circles)])


def _keep_courses(found: Hysteresis, name: str, courses: Sequence[Mapping[Quantity, Array]]) -> None:
    """Write the courses of loops or circles one below the other; nothing where there are none."""
    import numpy as np

    if courses:
        columns = {each.name: np.concatenate([course[each] for course in courses]) for each in courses[0]}
        found.findings.table(f"data/{name}.csv", columns, *documented(courses[0]))


def _keep_metrics(found: Hysteresis) -> None:
    """Keep the numbers of the main friction over the first range as metrics."""
    findings, main = found.findings, found.main
    findings.metric("not_converged", still_change(found.every), "", "lower", len(found.every), meaning=_NOT_CONVERGED)
    slow, *faster = by_speed(found.loops, main)
    case = f"mu {main.friction:g}, sheath {main.sheath:g} rad"
    swing = f"{math.degrees(slow.case.low):g} to {math.degrees(slow.case.high):g} deg"
    if band := middle_band(found.dead_bands, main):
        meaning = f"at {math.degrees(band.unhindered):g} deg, {case}"
        findings.metric("dead_band", math.degrees(band.width), "deg", "lower", meaning=meaning)
    findings.metric("friction_work", slow.friction_work, "J", "lower", meaning=f"a cycle of {swing}, {case}")
    if faster and slow.friction_work > 0.0:
        change = abs(faster[0].friction_work / slow.friction_work - 1.0)
        meaning = f"between {slow.case.frequency:g} and {faster[0].case.frequency:g} Hz, {case}"
        findings.metric("friction_work_change", change, "", "lower", meaning=meaning)
    if slid := [band for band in found.dead_bands if band.slid and band.exact_width > 1e-9]:
        worst = max(abs(band.width / band.exact_width - 1.0) for band in slid)
        meaning = "largest relative error of a simulated dead band against the roots of the statics"
        findings.metric("root_error", worst, "", "lower", len(slid), meaning=meaning)
