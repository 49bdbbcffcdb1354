"""One closed loop, linearised about where it rests: margins, step, root locus, and the sliding surface's portrait."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.commands.analyse.answer import listed
from wristctl.commands.analyse.hysteresis import HYSTERESIS
from wristctl.commands.analyse.hysteresis_results import Hysteresis
from wristctl.commands.analyse.results import (
    CUTS,
    Analysed,
    draw,
    limit_table,
    locus_table,
    portrait_table,
    tables_of_margins,
    write,
)
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import FROM_IDENTIFIED, EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_simulation,
    check_inverse,
    check_motion,
    check_row,
    check_tuned,
    network_for,
    planes_of_simulation,
    tuned_gains,
)
from wristctl.commands.loop_warnings import (
    warn_if_coarse,
    warn_if_it_buckles,
    warn_of_one_plane,
    warn_outside_conditions,
)
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.session import Session
from wristctl.commands.stiffness_table import stiffness_table
from wristctl.config.study import Study
from wristctl.errors import UserError, meant, under

if TYPE_CHECKING:
    from wristctl.arrays import Array
    from wristctl.config.loop import Loop
    from wristctl.stability.loop_analysis import AnalysedRow, LoopAnalysis
    from wristctl.stability.phase_portrait import PhasePortrait
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

# Change of a law's slope over 1e-4 typical sizes from which its margins are of less than anybody can see.
_CURVED = 0.05


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controller, its gains, what the root locus goes over, and the angles."""
    from wristctl.control.table import controller
    from wristctl.stability.loop_ticks import looks_back
    from wristctl.stability.smooth_loop import smooth

    settings, chosen = study.analyse, study.simulate
    known = identified(study, "simulate", inputs)
    planes = planes_of_simulation(known)
    with under("simulate"):
        check_row(chosen, tuned_gains(inputs), inputs.runs().get("tuned"))
        check_tuned([chosen], inputs)
        check_motion(known, planes)
        check_inverse(chosen.reference, inputs)
        looks_back(smooth(chosen.loop, settings.friction))
    law = controller(chosen.controller)
    if law.plain:
        reason = f"{law.name} is plain Python, and only compiled controllers can be linearised"
        fix = (
            "leave out plain=True and write it so that it compiles (documentation: Compiled code); simulate shows its "
            "answer to a step"
        )
        raise UserError(reason, "simulate.controller", fix)
    if settings.over not in ("loop", *law.gains):
        reason = f"{law.name} has no gain '{settings.over}' for a root locus"
        raise UserError(reason, "analyse.over", meant(settings.over, ["loop", *law.gains]))
    far = [angle for angle in settings.angles_deg if abs(angle) > study.wrist.range_deg]
    if far:
        reason = f"{far[0]:g} deg lies outside the wrist's range of +-{study.wrist.range_deg:g} deg"
        raise UserError(reason, "analyse.angles_deg", "smaller angles, or widen wrist.range_deg")
    angles = listed(settings.angles_deg) if settings.angles_deg else "where its reference begins, is half way, and ends"
    where = " in two planes" * (planes == 2)
    return f"linearise {chosen.controller}{where} at rest at {angles}, friction {settings.friction}"


def analyse(session: Session) -> Analysed | Hysteresis:
    """Find margins, sensitivity, step, root locus and phase portrait of one closed loop at rest.

    The loop is that of the `simulate` section, in one plane or in two, as `simulate` finds them;
    exit code 3 where it is unstable. With `--of hysteresis` it is the wrist alone, by the section
    `hysteresis`: loops of tension and angle, the dead band, circles in two planes.
    """
    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    chosen, settings, planes = study.simulate, study.analyse, planes_of_simulation(study)
    warn_if_it_buckles(findings, study.wrist, [chosen.loop], planes)
    warn_if_coarse([chosen.loop])
    warn_of_one_plane(study.wrist, asked_of_simulation(study))
    warn_outside_conditions([chosen], [chosen.loop])
    _warn_of_frames(chosen.loop)
    network = network_for(session.inputs, study.wrist, [chosen.loop], planes)
    row, rests = _row(study, session.inputs, planes), _rests(study, planes, network)
    angles, analyses = rests.angles, []
    with session.progress("linearising the loop", len(angles), "angles") as report:
        for angle in angles:
            analyses.append(_at_rest(row, study, rests, angle))
            report(len(analyses))
    locus, last = None, angles[-1]
    if not all(analysis.is_open for analysis in analyses):
        with session.progress("following the poles"):
            locus = row.locus(rests.bend(last), settings.over, settings.span)
    portrait = _portrait(session, row, study, rests, last)
    label = f"{row.law.name}/{chosen.gains if isinstance(chosen.gains, str) else 'given'}{rests.words(study)}"
    findings.overview.figure = "bode"
    findings.numerics(planes=planes)
    tables: list[Table] = []
    result = Analysed(session.study, findings, tables, label, angles, analyses, locus, portrait, rests.toward_deg)
    write(result)
    with session.drawing():
        draw(result)
    tables += tables_of_margins(result.records())
    if locus is not None:
        over = "" if settings.over == "loop" else settings.over
        unit = row.law.gains[over].unit if over else ""
        tables.append(locus_table(locus, row.gains[over] if over else None, unit, settings.span))
    tables.append(limit_table(analyses[-1], CUTS[chosen.loop.sensor.level]))
    tables.append(stiffness_table(row.wrist, row.loop, planes))
    tables += [] if portrait is None else [portrait_table(portrait)]
    return result


def _row(study: Study, inputs: Inputs, planes: int) -> AnalysedRow:
    from wristctl.control.table import controller, gains_of
    from wristctl.simulation.worlds import loop_facing
    from wristctl.stability.loop_analysis import AnalysedRow

    chosen = study.simulate
    law = controller(chosen.controller)
    gains = dict(zip(law.gains, gains_of(law, chosen.gains, tuned_gains(inputs), chosen.loop), strict=True))
    one_plane = planes == 1
    wrist, loop = loop_facing(study.wrist, chosen.loop, chosen.direction) if one_plane else (study.wrist, chosen.loop)
    return AnalysedRow(law, gains, loop, wrist, study.analyse.friction)


class Rests(NamedTuple):
    """Resting angles [deg] along a direction of bends `toward` (P,), times `sign` in one plane."""

    angles: list[float]
    sign: float
    toward: Array

    def bend(self, angle: float) -> Any:
        """The bend at a resting angle [deg]: a number in one plane, (2,) in two [rad]."""
        return self.theta(angle) if len(self.toward) == 1 else self.theta(angle) * self.toward

    def theta(self, angle: float) -> float:
        """A resting angle along `toward` [rad]."""
        return self.sign * math.radians(angle)

    @property
    def toward_deg(self) -> float | None:
        """Direction of the bends from ulnar toward flexion [deg]; None in one plane."""
        if len(self.toward) == 1:
            return None
        return round(math.degrees(math.atan2(self.toward[1], self.toward[0])), 6) % 360.0

    def words(self, study: Study) -> str:
        """Planes and direction, in words; none of one plane."""
        from wristctl.simulation.planes import why_two
        from wristctl.wrist.directions import toward_words

        if self.toward_deg is None:
            return ""
        why = why_two(study.wrist, asked_of_simulation(study))
        reason = f" ({why})" if " out of " in why else ""
        return f" in two planes{reason} {toward_words(self.toward_deg)}"


def _rests(study: Study, planes: int, network: Inverse | None) -> Rests:
    """Resting angles toward the direction: those given, else straight, half way, and where the reference ends.

    A reference that never rests ends at its farthest. In two planes the direction is that of this end.
    """
    import numpy as np

    from wristctl.config.loop import sample_period
    from wristctl.simulation.planes import motion_in
    from wristctl.simulation.trajectory import size_of
    from wristctl.wrist.directions import DIRECTIONS, in_plane

    chosen, given = study.simulate, list(study.analyse.angles_deg)
    way, period = DIRECTIONS[chosen.direction], sample_period(chosen.loop.control_period)
    if given and planes == 1:
        return Rests(given, way.sign, np.ones(1))
    wrist = in_plane(study.wrist, chosen.direction) if planes == 1 else study.wrist
    followed = motion_in(planes, chosen.reference, chosen.direction, wrist, chosen.horizon, period, network)
    farthest = int(np.argmax(size_of(followed.bend_ref)))
    end = followed.bend_ref[-1 if followed.rest < followed.horizon else farthest]
    if planes == 1:
        sign, toward, size = float(way.sign), np.ones(1), float(end[0]) * way.sign
    else:
        size, sign = float(np.hypot(*end)), 1.0
        of_plane = way.sign * np.eye(2)[int(way.plane == "flexion")]
        toward = end / size if size > 0.0 else of_plane
    degrees = round(math.degrees(size), 6)
    return Rests(given or ([0.0, 0.5 * degrees, degrees] if degrees else [0.0]), sign, toward)


def _warn_of_frames(loop: Loop) -> None:
    from wristctl.stability.smooth_loop import smooth

    rate, configured = smooth(loop, "slipping").sensor.frame_rate, loop.sensor.frame_rate
    if loop.sensor.level == "camera" and rate != configured:
        log.warning("frames at %g Hz repeat on no few control periods: linearised with %.5g Hz", configured, rate)


def _at_rest(row: AnalysedRow, study: Study, rests: Rests, angle: float) -> LoopAnalysis:
    """The loop about one resting angle [deg]; UserError where it rests nowhere near, or beyond what tendons bear."""
    analysis = row.analysed(rests.bend(angle), rests.toward)
    if analysis is None:
        fix = "other gains, or another angle in analyse.angles_deg"
        raise UserError(f"the loop rests nowhere near {angle:g} deg", "simulate.gains", fix)
    most, bears = max(analysis.linear.tensions), study.wrist.tension_limit
    if study.simulate.loop.limits and most > bears:
        reason = f"to rest at {angle:g} deg takes {most:.3g} N in a tendon that bears {bears:g}"
        raise UserError(reason, "analyse.angles_deg", "a smaller angle, or a larger wrist.tension_limit")
    if analysis.linear.bend > _CURVED:
        log.warning("at %g deg the control law is not linear within 1e-4 rad: its margins are of smaller swings", angle)
    return analysis


def _portrait(
    session: Session, row: AnalysedRow, study: Study, rests: Rests, angle: float
) -> PhasePortrait | None:  # fmt: skip
    from wristctl.simulation.worlds import Draws
    from wristctl.stability.phase_portrait import SCENARIO, phase_portrait

    if row.law.surface is None:
        return None
    draws = Draws(study.seed)
    session.findings.note_streams(draws.names([row.loop], [SCENARIO]))
    with session.progress("simulating courses to the sliding surface"):
        theta, horizon = rests.theta(angle), study.simulate.horizon
        return phase_portrait(row.law, row.gains, row.loop, row.wrist, theta, horizon, draws, rests.toward)


ANALYSE: Procedure[Analysed | Hysteresis] = Procedure(
    "analyse",
    plan,
    analyse,
    (
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        FROM_IDENTIFIED,
    ),
    in_one_plane=no_tendons,
    mode=lambda study: HYSTERESIS if study.analyse.of == "hysteresis" else None,
)
