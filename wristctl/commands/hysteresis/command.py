"""Hysteresis of the wrist: loops of tension and angle, the dead band, and friction fitted to a measured loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.hysteresis.answer import measured_answer, model_answer
from wristctl.commands.hysteresis.circles import circle_tables, fate_of, in_um, write_circles
from wristctl.commands.hysteresis.measured import FITTED, fit_measured, problem_of, refuse_misfit
from wristctl.commands.inputs import Inputs, check_sides
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.commands.stiffness_table import stiffness_table
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.arrays import Array
    from wristctl.identification.friction_fit import FrictionFit
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase


_LOOPS = {
    "friction": ("", "coefficient of the tendons' friction"),
    "sheath": ("rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    "presliding": ("m", "path in which friction turns round"),
    "frequency": ("1/s", "cycles per second"),
    "low": ("rad", "angle without friction at one end"),
    "high": ("rad", "and at the other"),
    "width": ("rad", "by how much more it is bent on its way back, in the middle of the range"),
    "exact_width": ("rad", "dead band there, by the roots of the statics"),
    "friction_work": ("J", "what friction took in a cycle: pull at the spool less pull at the wrist, along the path"),
    "raw_work": ("J", "area of the loop of pulls at the spools along the path"),
    "damped_work": ("J", "what the wrist's damping took in a cycle"),
    "step": ("s", "integration step that it took"),
    "drift": ("", "largest relative change of width and works with the step, at the shortest tried; 0: converged"),
}
_OF_A_PLACE = {
    "given": ("m", "what this place has reeled in"),
    "spool": ("N", "pull of all its tendons at the spool"),
    "wrist": ("N", "pull of all its tendons at the wrist"),
    "z": ("", "state of its bristle"),
}
_COURSES = {
    "loop": ("", "row of loops.csv, from 0"),
    "time": ("s", "since the range's high end"),
    "unhindered": ("rad", "angle without friction on these spools"),
    "theta": ("rad", "angle"),
    "given_plus": ("m", "what the + side has reeled in"),
    "given_minus": ("m", "what the - side has"),
    "spool_plus": ("N", "pull of both tendons of the + side at the spool"),
    "spool_minus": ("N", "of the - side"),
    "wrist_plus": ("N", "pull of the + side at the wrist"),
    "wrist_minus": ("N", "of the - side"),
    "z_plus": ("", "state of the + side's bristle"),
    "z_minus": ("", "of the - side's"),
}
_OF_TWO_PLANES = {
    "theta": ("rad", "bend along the direction of the loop"),
    "bend_ulnar": ("rad", "bend toward ulnar"),
    "bend_flexion": ("rad", "bend toward flexion"),
}


def _columns_of(number: int, loop: HysteresisLoop) -> dict[str, Array]:
    """Courses of a loop by their names: of both sides in one plane, of each plane and each place in two."""
    import numpy as np

    course, two = loop.course, len(loop.toward) == 2
    columns = {"loop": np.full(len(loop.time), number), "time": loop.time, "unhindered": loop.unhindered}
    columns["theta"] = loop.bend
    if two:
        columns |= dict(zip(("bend_ulnar", "bend_flexion"), course.bends.T, strict=True))
    names = [str(place) for place in range(1, course.spool.shape[1] + 1)] if two else ["plus", "minus"]
    for kind in _OF_A_PLACE:
        columns |= {f"{kind}_{name}": column for name, column in zip(names, getattr(course, kind).T, strict=True)}
    return columns


def _meaning_of(column: str, two: bool) -> tuple[str, str]:
    kind, _, place = column.partition("_")
    if place.isdigit():
        return _OF_A_PLACE[kind]
    return _OF_TWO_PLANES[column] if two and column in _OF_TWO_PLANES else _COURSES[column]


_BANDS = {
    "friction": _LOOPS["friction"],
    "sheath": _LOOPS["sheath"],
    "presliding": _LOOPS["presliding"],
    "unhindered": ("rad", "angle without friction"),
    "exact_below": ("rad", "rest from below by the statics"),
    "exact_above": ("rad", "rest from above by the statics"),
    "below": ("rad", "rest after a ramp from below"),
    "above": ("rad", "rest after a ramp from above"),
    "slid": ("", "whether tendons slid far enough on both ramps to bend their bristles fully"),
    "step": _LOOPS["step"],
    "drift": ("", "largest change of a rest with the step, over the width, at the shortest tried; 0: converged"),
}


@dataclass(frozen=True, repr=False, eq=False)
class Hysteresis(StudyResult):
    """Loops of a wrist on its tendons, the dead band, and the fit of a measured loop where there was one."""

    kind = "hysteresis"

    loops: list[HysteresisLoop]
    dead_bands: list[DeadBand]
    circles: list[HysteresisCircle]
    fits: list[FrictionFit]
    """Fits of a measured loop that were tried, the chosen one last."""

    @property
    def fit(self) -> FrictionFit | None:
        """The chosen fit of a measured loop."""
        return self.fits[-1] if self.fits else None

    @property
    def answer(self) -> Answer:
        """A measured loop's own shape and fit, else the dead band and loops of the wrist."""
        from wristctl.simulation.hysteresis import main_case
        from wristctl.simulation.strokes import why_in_two_planes

        where = f", or {self.findings.run.path}/report.html" if self.findings.run else ""
        if self.fit is not None:
            return measured_answer(self.fits, self.study.wrist, f"All that was fitted: --all{where}.")
        why = why_in_two_planes(self.study.wrist, self.study.hysteresis)
        main, more = main_case(self.study.hysteresis), f"Every loop: --all{where}."
        return model_answer(self.loops, self.dead_bands, self.circles, main, more, why)

    @property
    def marks(self) -> list[str]:
        """Number of loops, dead bands and circles that still change with the integration step."""
        every: list[HysteresisLoop | DeadBand | HysteresisCircle] = [*self.loops, *self.dead_bands, *self.circles]
        open_ = _still_change(every)
        return [f"not converged: {open_} of {len(every)}"] * bool(open_)

    def frame(self) -> pd.DataFrame:
        """One row per loop: friction, speed, range, the dead band in its middle, and works; SI units."""
        import pandas as pd

        cases = [loop.case.tendons._asdict() | loop.case._asdict() for loop in self.loops]
        columns = [name for name in _LOOPS if name not in (cases[0] if cases else ())]
        values_of = [{name: getattr(loop, name) for name in columns} for loop in self.loops]
        rows = [case | values for case, values in zip(cases, values_of, strict=True)]
        return pd.DataFrame(rows, columns=list(_LOOPS))


def plan(study: Study, inputs: Inputs) -> str:
    """See that the wrist can be driven so, or that a measured loop can be read."""
    from wristctl.simulation.hysteresis import loop_cases
    from wristctl.simulation.hysteresis_circles import check_circles, circle_cases
    from wristctl.simulation.strokes import strokes, why_in_two_planes

    settings = study.hysteresis
    if settings.measured is not None:
        check_sides(study.wrist, "hysteresis --measured")
        for key in ("toward_deg", "circles_deg"):
            if getattr(settings, key):
                raise UserError("a measured loop is of one plane", f"hysteresis.{key}", "leave it out")
        problem = problem_of(study)
        return f"{', '.join(FITTED)} from {len(problem.measured[0])} samples of {problem.loop.name}"
    strokes(study.wrist, settings)
    check_circles(study.wrist, settings)
    count, lasts = len(loop_cases(settings)), 1.5 * sum(1.0 / frequency for frequency in settings.frequencies)
    where = " in two planes" if why_in_two_planes(study.wrist, settings) else ""
    circles = f", and {circled} circles" if (circled := len(circle_cases(settings))) else ""
    seconds = lasts * (count + 1.75 / 1.5 * circled) / len(settings.frequencies)
    return f"{count} loops{where}{circles}, {seconds:.3g} simulated seconds"


def hysteresis(session: Session) -> Hysteresis:
    """Drive the wrist through hysteresis loops, or fit friction to a measured one.

    Its spools go to and fro at several speeds, over several ranges, for several frictions, in one plane or, toward any
    direction and with any tendons, in two; there it goes around circles too (`circles_deg`). Of a measured loop (an
    open log) friction of tendons and wrist, stiffness, radius and slack are found, with 95 % intervals; one that no
    model fits is refused.
    """
    if session.study.hysteresis.measured is not None:
        return _of_measured(session)
    from wristctl.commands.hysteresis import figures
    from wristctl.simulation.hysteresis import dead_bands, loops, main_case
    from wristctl.simulation.hysteresis_circles import circles
    from wristctl.simulation.strokes import loop_of, strokes

    findings, settings = session.findings, session.study.hysteresis
    driven_strokes = strokes(session.study.wrist, settings)
    with session.progress("compiling and driving loops", 100, "%") as advance:
        driven = loops(driven_strokes, lambda share: advance(round(100.0 * share)))
        bands = dead_bands(driven_strokes)
    around: list[HysteresisCircle] = []
    if settings.circles_deg:
        with session.progress("going around circles", 100, "%") as advance:
            around = circles(session.study.wrist, settings, lambda share: advance(round(100.0 * share)))
    every: list[HysteresisLoop | DeadBand | HysteresisCircle] = [*driven, *bands, *around]
    findings.numerics(
        integrator="RODAS3", step=min(item.step for item in every), segments=settings.segments,
        planes=driven_strokes.planes,
    )  # fmt: skip
    open_ = _still_change(every)
    findings.metric("not_converged", open_, "", "lower", len(every), meaning=_NOT_CONVERGED)
    tables = _tables(findings, driven, bands, main_case(settings)) + circle_tables(around)
    tables.append(stiffness_table(session.study.wrist, loop_of(settings), driven_strokes.planes))
    result = Hysteresis(session.study, findings, tables, driven, bands, around, [])
    _write(findings, result)
    with session.drawing():
        if bands:
            findings.figure("dead-band", figures.dead_band, driven_strokes, bands)
        findings.figure("loops", figures.loops, driven_strokes, driven)
        if len(settings.ranges_deg) > 1:
            findings.figure("minor-loops", figures.minor_loops, driven_strokes, driven)
        findings.figure("work", figures.work, driven_strokes, driven)
        if around:
            findings.figure("circles", figures.circles, around)
    return result


def _of_measured(session: Session) -> Hysteresis:
    """Fit a measured loop; one that no model fits is refused, with all that was found in the run."""
    fits, tables = fit_measured(session)
    chosen, settings = fits[-1], session.study.hysteresis
    session.findings.numerics(integrator="RODAS3", step=chosen.problem.step, segments=settings.segments)
    result = Hysteresis(session.study, session.findings, tables, [], [], [], fits)
    try:
        refuse_misfit(fits)
    except UserError:
        text = "\n".join(result.answer.lines())
        session.findings.summary(
            "\n\n".join(f"```\n{part}\n```" for part in (text, *(table.text() for table in tables)))
        )
        session.operator.tell(text)
        raise
    return result


def _write(findings: Findings, results: Hysteresis) -> None:
    import numpy as np
    import pandas as pd

    def units(columns: dict[str, tuple[str, str]]) -> tuple[dict[str, str], dict[str, str]]:
        return {name: unit_and_meaning[0] for name, unit_and_meaning in columns.items()}, {
            name: unit_and_meaning[1] for name, unit_and_meaning in columns.items()
        }

    findings.table("data/loops.csv", results.frame(), *units(_LOOPS))
    courses, two = [_columns_of(*row) for row in enumerate(results.loops)], len(results.loops[0].toward) == 2
    columns = {name: np.concatenate([course[name] for course in courses]) for name in courses[0]}
    findings.table("data/courses.csv", columns, *units({name: _meaning_of(name, two) for name in columns}))
    if results.dead_bands:
        rows = [
            {name: getattr(band, name, None) for name in _BANDS} | band.tendons._asdict() for band in results.dead_bands
        ]
        findings.table("data/dead_bands.csv", pd.DataFrame(rows)[list(_BANDS)], *units(_BANDS))
    write_circles(findings, results.circles)


_NOT_CONVERGED = "loops, dead bands and circles that still change with the integration step"
# Loops and dead bands that are all printed; of more, those with the main path of presliding, all being in data.
_MOST = 60


def _tables(
    findings: Findings, driven: Sequence[HysteresisLoop], bands: Sequence[DeadBand], main: FrictionCase
) -> list[Table]:
    """The outer loops, under what they say in words, and the dead bands."""
    first, many = driven[0].case, len(driven) + len(bands) > _MOST
    outer = [loop for loop in driven if (loop.case.low, loop.case.high) == (first.low, first.high)]
    fate = ("fate",) * (_still_change([*driven, *bands]) > 0)
    heads = ("friction", "sheath [rad]", "presliding [um]")
    loop_heads = ("frequency [Hz]", "width [deg]", "statics [deg]", "friction [mJ]", "damping [mJ]", "raw loop [mJ]",
                  "step [ms]", *fate)  # fmt: skip
    rows = [
        (*in_um(loop.case.tendons), loop.case.frequency, math.degrees(loop.width), math.degrees(loop.exact_width),
         *(1e3 * part for part in (loop.friction_work, loop.damped_work, loop.raw_work, loop.step)),
         *(fate_of(loop),) * len(fate))
        for loop in outer
        if not many or loop.case.tendons.presliding == main.presliding
    ]  # fmt: skip
    tables = [Table(_told(findings, outer, bands, main), (*heads, *loop_heads), rows)]
    if bands:
        held = ("angle [deg]", "dead band [deg]", "statics [deg]", "slid fully", "step [ms]", *fate)
        rests = [
            (*in_um(band.tendons), *map(math.degrees, (band.unhindered, band.width, band.exact_width)), band.slid,
             1e3 * band.step, *(fate_of(band),) * len(fate))
            for band in bands
            if not many or band.tendons.presliding == main.presliding
        ]  # fmt: skip
        tables.append(Table("Where ramps leave the wrist", (*heads, *held), rests))
    return tables


def _told(findings: Findings, outer: Sequence[HysteresisLoop], bands: Sequence[DeadBand], chosen: FrictionCase) -> str:
    """Text of the results for the main friction case. Its numbers become metrics of the run."""
    slow, *faster = sorted((e for e in outer if e.case.tendons == chosen), key=lambda e: e.case.frequency)
    case = f"mu {chosen.friction:g}, sheath {chosen.sheath:g} rad"
    swing = f"{math.degrees(slow.case.low):g} to {math.degrees(slow.case.high):g} deg"
    lines = []
    if mine := [item for item in bands if item.tendons == chosen]:
        band = mine[len(mine) // 2]
        width, exact, angle = (math.degrees(quantity) for quantity in (band.width, band.exact_width, band.unhindered))
        lines.append(f"dead band {width:.3g} deg at {angle:g} deg (roots of the statics: {exact:.3g} deg)")
        findings.metric("dead_band", width, "deg", "lower", meaning=f"at {angle:g} deg, {case}")
    lines.append(f"friction takes {1e3 * slow.friction_work:.3g} mJ a cycle of {swing}")
    findings.metric("friction_work", slow.friction_work, "J", "lower", meaning=f"a cycle of {swing}, {case}")
    if faster and slow.friction_work > 0.0:
        change = abs(faster[0].friction_work / slow.friction_work - 1.0)
        speeds = f"{slow.case.frequency:g} and {faster[0].case.frequency:g} Hz"
        lines[-1] += f", the same within {100.0 * change:.2g} % at {speeds}"
        findings.metric("friction_work_change", change, "", "lower", meaning=f"between {speeds}, {case}")
    damped = ", ".join(f"{1e3 * e.damped_work:.3g} mJ at {e.case.frequency:g} Hz" for e in (slow, *faster))
    lines.append(f"the wrist's damping makes up the rest of the raw loop: {damped}")
    if slid := [item for item in bands if item.slid and item.exact_width > 1e-9]:
        worst = max(abs(item.width / item.exact_width - 1.0) for item in slid)
        meaning = "largest relative error of a simulated dead band against the roots of the statics"
        findings.metric("root_error", worst, "", "lower", len(slid), meaning=meaning)
    if open_ := _still_change([*outer, *bands]):
        lines.append(f"NOT CONVERGED: {open_} of {len(outer) + len(bands)} change with the integration step")
    return f"{case}: " + ";\n".join(lines)


def _still_change(every: Sequence[HysteresisLoop | DeadBand | HysteresisCircle]) -> int:
    """Number of loops, dead bands and circles that change with the integration step."""
    return sum(item.drift > 0.0 for item in every)


HYSTERESIS = Procedure("hysteresis", plan, hysteresis, in_one_plane=no_tendons)
