"""One closed loop, linearised about where it rests: margins, step, root locus, and the sliding surface's portrait."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.analyse.answer import (
    CUTS,
    LoopResults,
    answer,
    draw,
    limit_table,
    listed,
    locus_table,
    margin_table,
    on_a_screen,
    portrait_table,
    step_table,
    write,
)
from wristctl.commands.answer import Answer
from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    check_inverses,
    check_reach,
    check_row,
    identified,
    inverses_of,
    network_for,
    tuned_gains,
)
from wristctl.commands.loop_warnings import warn_if_coarse, warn_if_it_buckles, warn_outside_conditions
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError, meant, under

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from wristctl.config.loop import Loop
    from wristctl.stability.loop_analysis import AnalysedRow, LoopAnalysis, RootLocus
    from wristctl.stability.phase_portrait import PhasePortrait
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

# Change of a law's slope over 1e-4 typical sizes from which its margins are of less than anybody can see.
_CURVED = 0.05


@dataclass(frozen=True, repr=False, eq=False)
class Analysed(StudyResult):
    """One loop about each of its resting angles [deg]; `sentence` is what it comes to."""

    kind = "analyse"

    label: str
    """Controller with its gains."""
    sentence: str
    angles: Sequence[float]
    found: Sequence[LoopAnalysis]
    """Analysis at each resting angle."""
    locus: RootLocus | None
    """Root locus at the last angle; None where nothing is fed back."""
    portrait: PhasePortrait | None
    """Phase portrait of a sliding law, toward the last angle; None of another law."""

    @property
    def answer(self) -> Answer:
        """Whether the loop is stable, with its least margins."""
        return on_a_screen(self.label, self.sentence, self.found, self.angles)

    @property
    def fault(self) -> UserError | None:
        """Error that names the angles at which the loop is unstable; None where it is stable."""
        bad = [angle for angle, analysis in zip(self.angles, self.found, strict=True) if not analysis.margins.stable]
        if not bad:
            return None
        fix = "look at the figures; try other gains, or a shorter control_period"
        return UserError(f"the loop is unstable at {listed(bad)}", self.place, fix, exit_code=3)

    def frame(self) -> pd.DataFrame:
        """Margins and step, a row per resting angle [deg]; SI units, phase margins in rad, inf: no limit."""
        import pandas as pd

        from wristctl.commands.analyse.answer import margins_of

        return pd.DataFrame([margins_of(*row) for row in zip(self.angles, self.found, strict=True)])


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controller, its gains, what the root locus goes over, and the angles."""
    from wristctl.control.table import controller
    from wristctl.stability.loop_ticks import looks_back
    from wristctl.stability.smooth_loop import smooth

    settings, chosen = study.analyse, study.simulate
    with under("simulate"):
        check_row(chosen, tuned_gains(inputs), inputs.runs().get("tuned"))
        check_reach([chosen.reference], identified(study, "analyse", inputs).wrist, "reference")
        check_inverses(inverses_of([chosen.reference]), inputs)
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
    return f"linearise {chosen.controller} at rest at {angles}, friction {settings.friction}"


def analyse(session: Session) -> Analysed:
    """Linearise one closed loop at rest: gain, phase and delay margins, sensitivity, step, root locus, phase portrait.

    The loop is that of the `simulate` section. Exit code 3 where it is unstable.
    """
    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    chosen, settings = study.simulate, study.analyse
    warn_if_it_buckles(findings, study.wrist, [chosen.loop])
    warn_if_coarse([chosen.loop])
    warn_outside_conditions([chosen], [chosen.loop])
    _warn_of_frames(chosen.loop)
    network = network_for(session.inputs, study.wrist, [chosen.loop])
    row, angles = _row(study, session.inputs), _angles(study, network)
    analyses = []
    with session.progress("linearising the loop", len(angles), "angles") as report:
        for angle in angles:
            analyses.append(_at_rest(row, study, angle))
            report(len(analyses))
    locus, last = None, _theta(study, angles[-1])
    if not all(analysis.is_open for analysis in analyses):
        with session.progress("following the poles"):
            locus = row.locus(last, settings.over, settings.span)
    portrait = _portrait(session, row, study, last)
    label = f"{row.law.name}/{chosen.gains if isinstance(chosen.gains, str) else 'given'}"
    sentence = answer(label, analyses, angles)
    findings.overview.figure = "bode"
    results = LoopResults(angles, analyses, locus, portrait)
    write(findings, results)
    with session.drawing():
        draw(findings, label, results)
    tables = [margin_table(sentence, analyses, angles), step_table(analyses, angles)]
    if locus is not None:
        value = None if settings.over == "loop" else row.gains[settings.over]
        tables.append(
            locus_table(locus, value, "" if value is None else row.law.gains[settings.over].unit, settings.span)
        )
    tables.append(limit_table(analyses[-1], CUTS[chosen.loop.sensor.level]))
    tables += [] if portrait is None else [portrait_table(portrait)]
    return Analysed(session.study, findings, tables, label, sentence, angles, analyses, locus, portrait)


def _row(study: Study, inputs: Inputs) -> AnalysedRow:
    from wristctl.control.table import controller, gains_of
    from wristctl.stability.loop_analysis import AnalysedRow
    from wristctl.wrist.directions import in_plane

    chosen = study.simulate
    law = controller(chosen.controller)
    gains = dict(zip(law.gains, gains_of(law, chosen.gains, tuned_gains(inputs)), strict=True))
    wrist = in_plane(study.wrist, chosen.direction)
    return AnalysedRow(law, gains, chosen.loop, wrist, study.analyse.friction)


def _angles(study: Study, network: Inverse | None) -> list[float]:
    """Resting angles [deg] toward the direction: those given, else straight, half way, and where the reference ends.

    A reference that never rests ends at its farthest.
    """
    from wristctl.config.loop import sample_period
    from wristctl.simulation.reference import motion, toward
    from wristctl.wrist.directions import in_plane

    chosen = study.simulate
    if study.analyse.angles_deg:
        return list(study.analyse.angles_deg)
    wrist, period = in_plane(study.wrist, chosen.direction), sample_period(chosen.loop.control_period)
    followed = motion(toward(chosen.reference, chosen.direction), wrist, chosen.horizon, period, network)
    rests = followed.rest < followed.horizon
    end = followed.final if rests else float(max(followed.theta_ref, key=abs))
    degrees = round(math.degrees(end) * _sign(study), 6)
    return [0.0, 0.5 * degrees, degrees] if degrees else [0.0]


def _warn_of_frames(loop: Loop) -> None:
    from wristctl.stability.smooth_loop import smooth

    rate, configured = smooth(loop, "slipping").sensor.frame_rate, loop.sensor.frame_rate
    if loop.sensor.level == "camera" and rate != configured:
        log.warning("frames at %g Hz repeat on no few control periods: linearised with %.5g Hz", configured, rate)


def _sign(study: Study) -> float:
    from wristctl.wrist.directions import DIRECTIONS

    return DIRECTIONS[study.simulate.direction].sign


def _theta(study: Study, angle: float) -> float:
    return _sign(study) * math.radians(angle)


def _at_rest(row: AnalysedRow, study: Study, angle: float) -> LoopAnalysis:
    """The loop about one resting angle [deg]; UserError where it rests nowhere near, or beyond what tendons bear."""
    analysis = row.analysed(_theta(study, angle))
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


def _portrait(session: Session, row: AnalysedRow, study: Study, theta: float) -> PhasePortrait | None:
    from wristctl.simulation.worlds import Draws
    from wristctl.stability.phase_portrait import SCENARIO, phase_portrait

    if row.law.surface is None:
        return None
    draws = Draws(study.seed)
    session.findings.note_streams(draws.names([row.loop], [SCENARIO]))
    with session.progress("simulating courses to the sliding surface"):
        return phase_portrait(row.law, row.gains, row.loop, row.wrist, theta, study.simulate.horizon, draws)


ANALYSE = Procedure(
    "analyse",
    plan,
    analyse,
    (
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
    ),
)
