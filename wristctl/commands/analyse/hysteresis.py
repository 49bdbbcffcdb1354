"""Hysteresis of the wrist on its tendons: it is driven to and fro, and around, without a controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.commands.analyse.hysteresis_results import Hysteresis, tables_of, write
from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.session import Session
from wristctl.commands.stiffness_table import stiffness_table
from wristctl.config.study import Study

if TYPE_CHECKING:
    from wristctl.simulation.hysteresis_circles import HysteresisCircle


def plan(study: Study, inputs: Inputs) -> str:
    """See that the wrist can be driven so."""
    from wristctl.simulation.hysteresis import loop_cases
    from wristctl.simulation.hysteresis_circles import check_circles, circle_cases
    from wristctl.simulation.strokes import strokes, why_in_two_planes

    settings = study.hysteresis
    strokes(study.wrist, settings)
    check_circles(study.wrist, settings)
    count, lasts = len(loop_cases(settings)), 1.5 * sum(1.0 / frequency for frequency in settings.frequencies)
    where = " in two planes" if why_in_two_planes(study.wrist, settings) else ""
    circles = f", and {circled} circles" if (circled := len(circle_cases(settings))) else ""
    seconds = lasts * (count + 1.75 / 1.5 * circled) / len(settings.frequencies)
    return f"{count} loops{where}{circles}, {seconds:.3g} simulated seconds"


def hysteresis(session: Session) -> Hysteresis:
    """Drive the wrist through hysteresis loops, and around circles.

    Its spools go to and fro at several speeds, over several ranges, for several frictions, in one plane or, toward any
    direction and with any tendons, in two; there it goes around circles too (`circles_deg`).
    """
    from wristctl.commands.analyse import hysteresis_figures as figures
    from wristctl.simulation.hysteresis import dead_bands, loops
    from wristctl.simulation.hysteresis_circles import circles
    from wristctl.simulation.strokes import loop_of, strokes

    findings, study, settings = session.findings, session.study, session.study.hysteresis
    driven_strokes = strokes(study.wrist, settings)
    with session.progress("driving loops", 100, "%") as advance:
        driven = loops(driven_strokes, lambda share: advance(round(100.0 * share)))
        bands = dead_bands(driven_strokes)
    around: list[HysteresisCircle] = []
    if settings.circles_deg:
        with session.progress("going around circles", 100, "%") as advance:
            around = circles(study.wrist, settings, lambda share: advance(round(100.0 * share)))
    tables: list[Table] = []
    found = Hysteresis(study, findings, tables, driven, bands, around)
    findings.numerics(
        integrator="RODAS3", step=min(item.step for item in found.every), segments=settings.segments,
        planes=driven_strokes.planes,
    )  # fmt: skip
    tables += [*tables_of(found), stiffness_table(study.wrist, loop_of(settings), driven_strokes.planes)]
    write(found)
    with session.drawing():
        if bands:
            findings.figure("dead-band", figures.dead_band, driven_strokes, bands)
        findings.figure("loops", figures.loops, driven_strokes, driven)
        if len(settings.ranges_deg) > 1:
            findings.figure("minor-loops", figures.minor_loops, driven_strokes, driven)
        findings.figure("work", figures.work, driven_strokes, driven)
        if around:
            findings.figure("circles", figures.circles, around)
    return found


HYSTERESIS = Procedure("analyse", plan, hysteresis, in_one_plane=no_tendons, works_on="hysteresis")
