"""A measured loop: its fits, what came out of them as tables and warnings, and the refusal of what no model fits."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import Setting, UserError

if TYPE_CHECKING:
    from wristctl.identification.friction_fit import FrictionEstimate, FrictionFit
    from wristctl.identification.loop_problem import LoopProblem

log = logging.getLogger(__name__)

# Fitted parameters: unit and meaning.
FITTED = {
    "friction": ("", "coefficient of the tendons' friction, mu"),
    "sheath": ("rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    "presliding": ("m", "path in which friction turns round"),
}
# Share of the presliding by which a loop may leap between two samples at its turns.
_COARSE = 0.25

# Share of the noise by which what is expected may change with the integration step.
_STEP_ERROR = 0.1
# Share of the dead band in pull, pull times exponent, by which pulls that drive a loop may tremble.
_TREMBLE = 0.01


def problem_of(study: Study) -> LoopProblem:
    """The study's measured loop. Raises UserError for a file that is none."""
    from wristctl.identification.loop_problem import LoopProblem
    from wristctl.identification.measured_loop import read_loop

    settings = study.hysteresis
    assert settings.measured is not None
    loop = read_loop(Path(settings.measured), study.wrist, settings.columns or "", settings.trial)
    return LoopProblem(loop, study.wrist, settings)


def fit_measured(session: Session) -> tuple[list[FrictionFit], list[Table]]:
    """The fits that were tried, the chosen one last, and the tables of what came out of them."""
    from wristctl.commands.hysteresis.figures import measured
    from wristctl.identification.friction_fit import fit_in_turn
    from wristctl.identification.intervals import ALIKE
    from wristctl.records.files import sha256_of

    findings, source = session.findings, Path(str(session.study.hysteresis.measured))
    with session.progress("fitting the measured loop"):
        fits = fit_in_turn(problem_of(session.study))
    friction_fit = fits[-1]
    if friction_fit.autocorrelation > ALIKE:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    if friction_fit.step_error > _STEP_ERROR:
        advice = "the fit depends on the integration step: half of it changes the model by %.2g of the noise - fix: %s"
        log.warning(advice, friction_fit.step_error, f"hysteresis.step: {0.5 * friction_fit.problem.step:g}")
    if friction_fit.leap > _COARSE * friction_fit.presliding.value:
        leap, path = 1e6 * friction_fit.leap, 1e6 * friction_fit.presliding.value
        fix = "sample more often, or turn more softly"
        advice = "the loop leaps %.2g um between two samples at its turns, and presliding is some %.2g um: %s - fix: %s"
        log.warning(advice, leap, path, "values may be off by more than their intervals", fix)
    loop = friction_fit.problem.loop
    if loop.winch and loop.tremble > _TREMBLE * friction_fit.exponent.value * float(loop.drive.mean()):
        fix = "measure the spools' positions too, or hang weights"
        advice = "the pulls that drive the loop tremble by %.2g N: presliding may come out too long - fix: %s"
        log.warning(advice, loop.tremble, fix)
    findings.plain("data/source.json", {"name": source.name, "sha256": sha256_of(source)})
    _write_fit(findings, friction_fit)
    findings.figure("measured", measured, friction_fit)
    _keep_fit(findings, friction_fit)
    return fits, [_tried_table(findings, fits)]


def _tried_table(findings: Findings, fits: Sequence[FrictionFit]) -> Table:
    """What each supposition leaves over."""
    findings.metric("misfit", fits[-1].misfit, "", "lower", fits[-1].count, meaning=_MISFIT)
    rows = [
        (
            fit.problem.supposed.words,
            len(fit.problem.free),
            math.degrees(fit.noise[0]),
            *map(float, fit.noise[1:]),
            fit.misfit,
        )
        for fit in fits
    ]
    tensions = ("+ tension [N]", "- tension [N]")[: len(fits[-1].noise) - 1]
    return Table(
        "What was supposed, in turn, and what it leaves over",
        ("supposed", "parameters", "angle [deg]", *tensions, "chi-square / dof"),
        rows,
    )


_MISFIT = "variance of what is left over, over that of the samples' own noise"


def refuse_misfit(fits: Sequence[FrictionFit]) -> None:
    """UserError where no supposition fits the measured loop."""
    fit, settings = fits[-1], fits[-1].problem.settings
    if settings.misfit == "tell" or fit.misfit <= settings.lack_of_fit:
        return
    worst = int(((fit.noise / fit.problem.noise) ** 2).argmax())
    sizes = (fit.noise[worst], fit.problem.noise[worst])
    model, samples = (f"{math.degrees(size):.2g} deg" if worst == 0 else f"{size:.2g} N" for size in sizes)
    problem = f"the best model is off by {model}, single samples by {samples}: it misses something"
    accept = ("look at the figure; or take it as it is: ", Setting("misfit=tell", "hysteresis"))
    raise UserError(problem, fit.problem.loop.name, accept, exit_code=3)


def _write_fit(findings: Findings, friction_fit: FrictionFit) -> None:
    columns = {"time": friction_fit.problem.loop.time[friction_fit.problem.first :]}
    names = ("theta", "tension_plus", "tension_minus")
    for name, samples, residual in zip(names, friction_fit.problem.measured, friction_fit.residuals, strict=False):
        columns |= {name: samples, f"{name}_model": samples - residual}
    units = {name: "s" if name == "time" else "rad" if name.startswith("theta") else "N" for name in columns}
    findings.table("data/measured.csv", columns, units)


def _keep_fit(findings: Findings, friction_fit: FrictionFit) -> None:
    """Keep what was found as metrics; of a value whose interval has no end the metric has none either."""
    for name, (unit, meaning) in FITTED.items():
        value, low, high = getattr(friction_fit, name)
        found, ends = (value, (low, high)) if math.isfinite(high) else (None, None)
        findings.metric(name, found, unit, "", friction_fit.count, ends, meaning)
    bend, exponent = friction_fit.told_best
    best = f"mu (bend + sheath) at a bend of {math.degrees(bend):.3g} deg, where it is told best"
    for name, estimate, unit, meaning in [("exponent", exponent, "", best), *_of_wrist(friction_fit)]:
        findings.metric(name, estimate.value, unit, "", friction_fit.count, (estimate.low, estimate.high), meaning)
    meaning = "of mu with bend + sheath, as logarithms, at the mean bend"
    findings.metric("correlation", friction_fit.correlation, n=friction_fit.count, meaning=meaning)


def _of_wrist(fit: FrictionFit) -> list[tuple[str, FrictionEstimate, str, str]]:
    """What was found of the wrist itself: name, value with its interval, unit, meaning."""
    found = [("stiffness", fit.stiffness, "N m/rad", "bending stiffness of the whole wrist")]
    if fit.inner_friction is not None and fit.inner_presliding is not None:
        found += [
            ("inner_friction", fit.inner_friction, "N m", "torque of friction inside the wrist"),
            ("inner_presliding", fit.inner_presliding, "rad", "bend in which that turns round"),
        ]
    if fit.problem.supposed.freed and not fit.problem.loop.winch:
        found += [("tendon_radius", fit.tendon_radius, "m", "radius of the tendons' circle")]
    names = zip(("slack_plus", "slack_minus"), fit.slack, strict=False)
    return found + [(name, slack, "m", "reeled in before it pulls, over its spool's count") for name, slack in names]
