"""Hysteresis of the wrist: loops of tension and angle, the dead band, and friction fitted to a measured loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.hysteresis.answer import measured_answer, model_answer
from wristctl.commands.hysteresis.measured import FITTED, fit_measured, problem_of, refuse_misfit
from wristctl.commands.hysteresis.tables import LOOPS, frame_of, still_change, tables_of, write
from wristctl.commands.inputs import Inputs, check_sides
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.commands.stiffness_table import stiffness_table
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.friction_fit import FrictionFit
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase


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
        open_ = still_change(every)
        return [f"not converged: {open_} of {len(every)}"] * bool(open_)

    def frame(self) -> pd.DataFrame:
        """One row per loop: friction, speed, range, the dead band in its middle, and works; SI units."""
        return frame_of(LOOPS, self.loops)


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
    with session.progress("driving loops", 100, "%") as advance:
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
    findings.metric("not_converged", still_change(every), "", "lower", len(every), meaning=_NOT_CONVERGED)
    _keep_metrics(findings, driven, bands, main_case(settings))
    tables = tables_of(driven, bands, around, main_case(settings))
    tables.append(stiffness_table(session.study.wrist, loop_of(settings), driven_strokes.planes))
    write(findings, driven, bands, around)
    with session.drawing():
        if bands:
            findings.figure("dead-band", figures.dead_band, driven_strokes, bands)
        findings.figure("loops", figures.loops, driven_strokes, driven)
        if len(settings.ranges_deg) > 1:
            findings.figure("minor-loops", figures.minor_loops, driven_strokes, driven)
        findings.figure("work", figures.work, driven_strokes, driven)
        if around:
            findings.figure("circles", figures.circles, around)
    return Hysteresis(session.study, findings, tables, driven, bands, around, [])


def _of_measured(session: Session) -> Hysteresis:
    """Fit a measured loop; one that no model fits is refused, with all that was found in the run."""
    fits, tables = fit_measured(session)
    chosen, settings = fits[-1], session.study.hysteresis
    session.findings.numerics(integrator="RODAS3", step=chosen.problem.step, segments=settings.segments)
    result = Hysteresis(session.study, session.findings, tables, [], [], [], fits)
    try:
        refuse_misfit(fits)
    except UserError:
        session.tell_refused(result.answer, tables)
        raise
    return result


_NOT_CONVERGED = "loops, dead bands and circles that still change with the integration step"


def _keep_metrics(
    findings: Findings, driven: Sequence[HysteresisLoop], bands: Sequence[DeadBand], main: FrictionCase
) -> None:
    """Keep the numbers of the main friction over the first range as metrics."""
    first = driven[0].case
    outer = [loop for loop in driven if (loop.case.low, loop.case.high) == (first.low, first.high)]
    slow, *faster = sorted((e for e in outer if e.case.tendons == main), key=lambda e: e.case.frequency)
    case = f"mu {main.friction:g}, sheath {main.sheath:g} rad"
    swing = f"{math.degrees(slow.case.low):g} to {math.degrees(slow.case.high):g} deg"
    if mine := [band for band in bands if band.tendons == main]:
        band = mine[len(mine) // 2]
        meaning = f"at {math.degrees(band.unhindered):g} deg, {case}"
        findings.metric("dead_band", math.degrees(band.width), "deg", "lower", meaning=meaning)
    findings.metric("friction_work", slow.friction_work, "J", "lower", meaning=f"a cycle of {swing}, {case}")
    if faster and slow.friction_work > 0.0:
        change = abs(faster[0].friction_work / slow.friction_work - 1.0)
        meaning = f"between {slow.case.frequency:g} and {faster[0].case.frequency:g} Hz, {case}"
        findings.metric("friction_work_change", change, "", "lower", meaning=meaning)
    if slid := [band for band in bands if band.slid and band.exact_width > 1e-9]:
        worst = max(abs(band.width / band.exact_width - 1.0) for band in slid)
        meaning = "largest relative error of a simulated dead band against the roots of the statics"
        findings.metric("root_error", worst, "", "lower", len(slid), meaning=meaning)


HYSTERESIS = Procedure("hysteresis", plan, hysteresis, in_one_plane=no_tendons)
