"""Friction of the tendons found from a measured loop: read, fitted, told and drawn."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.config.study import Study
from wristctl.report.printed_table import Table, number
from wristctl.studies.findings import Findings
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.identification.friction_fit import FrictionEstimate, FrictionFit
    from wristctl.identification.loop_problem import LoopProblem

log = logging.getLogger(__name__)

FITTED = {
    "friction": ("", "coefficient of the tendons' friction, mu"),
    "sheath": ("rad", "angle by which a tendon is wrapped before it reaches the wrist"),
    "presliding": ("m", "path in which friction turns round"),
}
"""What is found: unit and meaning."""
_COARSE = 0.25
"""Share of the presliding by which a loop may leap between two samples at its turns."""

_STEP_ERROR = 0.1
"""Share of the noise by which what is expected may change with the integration step."""
_TREMBLE = 0.01
"""Share of the dead band in pull, pull times exponent, by which pulls that drive a loop may tremble."""


def problem_of(study: Study) -> LoopProblem:
    """The study's measured loop. Raises UserError for a file that is none."""
    from wristctl.identification.loop_problem import LoopProblem
    from wristctl.identification.measured_loop import read_loop

    assert study.hysteresis.measured is not None
    return LoopProblem(read_loop(Path(study.hysteresis.measured), study.wrist), study.wrist, study.hysteresis)


def fit_measured(session: Session) -> tuple[FrictionFit, Table]:
    """The fit, and the table that says what came out of it."""
    from wristctl.identification.friction_fit import fit_friction
    from wristctl.identification.intervals import ALIKE
    from wristctl.records.files import sha256_of
    from wristctl.report.hysteresis_figures import measured

    findings, source = session.findings, Path(str(session.study.hysteresis.measured))
    with session.progress("fitting the measured loop"):
        found = fit_friction(problem_of(session.study))
    if found.autocorrelation > ALIKE:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    if found.step_error > _STEP_ERROR:
        told = "the fit depends on the integration step: half of it changes the model by %.2g of the noise - fix: %s"
        log.warning(told, found.step_error, f"hysteresis.step: {0.5 * session.study.hysteresis.step:g}")
    if found.leap > _COARSE * found.presliding.value:
        leap, path = 1e6 * found.leap, 1e6 * found.presliding.value
        fix = "sample more often, or turn more softly"
        told = "the loop leaps %.2g um between two samples at its turns, and presliding is some %.2g um: %s - fix: %s"
        log.warning(told, leap, path, "values may be off by more than their intervals", fix)
    loop = found.problem.loop
    if loop.winch and loop.tremble > _TREMBLE * found.exponent.value * float(loop.drive.mean()):
        fix = "measure the spools' positions too, or hang weights"
        told = "the pulls that drive the loop tremble by %.2g N: presliding may come out too long - fix: %s"
        log.warning(told, loop.tremble, fix)
    findings.plain("data/source.json", {"name": source.name, "sha256": sha256_of(source)})
    _write(findings, found)
    findings.figure("measured", measured, found)
    return found, _table(findings, found)


def _write(findings: Findings, found: FrictionFit) -> None:
    columns = {"time": found.problem.loop.time[found.problem.first :]}
    names = ("theta", "tension_plus", "tension_minus")
    for name, seen, residual in zip(names, found.problem.measured, found.residuals, strict=False):
        columns |= {name: seen, f"{name}_model": seen - residual}
    units = {name: "s" if name == "time" else "rad" if name.startswith("theta") else "N" for name in columns}
    findings.table("data/measured.csv", columns, units)


def _table(findings: Findings, found: FrictionFit) -> Table:
    rows: list[tuple[str, float, float | None, float | None, str, str]] = []
    for name, (unit, meaning) in FITTED.items():
        value, low, high = getattr(found, name)
        ended = math.isfinite(high)
        rows.append((name, value, low, high if ended else None, unit, meaning))
        findings.metric(name, value if ended else None, unit, "", found.count, (low, high) if ended else None, meaning)
    bend, exponent = found.told_best
    meaning = f"mu (bend + sheath) at a bend of {math.degrees(bend):.3g} deg, where it is told best"
    findings.metric("exponent", exponent.value, "", "", found.count, (exponent.low, exponent.high), meaning)
    rows.append(("exponent", *exponent, "", meaning))
    findings.metric("correlation", found.correlation, n=found.count, meaning=_CORRELATION)
    rows.append(("correlation", found.correlation, None, None, "", _CORRELATION))
    for name, unit, noise in zip(("angle", "+ tension", "- tension"), ("rad", "N", "N"), found.noise, strict=False):
        rows.append((f"{name}, left over", float(noise), None, None, unit, "standard deviation of measured less model"))
    heads = ("", "value", "95 % low", "95 % high", "unit", "meaning")
    return Table(_told(found), heads, rows)


_CORRELATION = "of mu with bend + sheath, as logarithms, at the mean bend"


def _told(found: FrictionFit) -> str:
    """What came out, in words."""
    friction, sheath, path = found.friction, found.sheath, found.presliding
    presliding = f"presliding {_between(path, 1e6)} um" if math.isfinite(path.high) else "nothing of presliding"
    if friction.low > 0.0 and math.isfinite(sheath.high):
        apart = f"mu {_between(friction)}, sheath {_between(sheath)} rad"
        return f"{found.problem.loop.name} tells {apart} and {presliding}"
    bend, exponent = found.told_best
    return (
        f"{found.problem.loop.name} tells mu (bend + sheath), {_between(exponent)} at a bend of "
        f"{math.degrees(bend):.3g} deg, and {presliding},\nbut not mu and the sheath apart: mu may be up to "
        f"{number(friction.high)}, the sheath {number(sheath.low)} rad or more; a wider range of bend would tell"
    )


def _between(found: FrictionEstimate, scale: float = 1.0) -> str:
    value, low, high = (number(scale * each) for each in found)
    return f"{value} ({low} to {high})"
