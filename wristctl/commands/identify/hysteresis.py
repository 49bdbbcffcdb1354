"""A measured loop of hysteresis: friction of tendons and inside the wrist, with intervals, or that no model fits."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer, rest
from wristctl.commands.identify.logs import logs_of
from wristctl.commands.inputs import check_sides
from wristctl.commands.printed_table import Table, degrees, two
from wristctl.commands.quantities import Quantity, keep_told, told_frame
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import Setting, UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.config.wrist import WristParameters
    from wristctl.identification.arc_fit import Told
    from wristctl.identification.friction_fit import FrictionEstimate, FrictionFit
    from wristctl.identification.loop_problem import LoopProblem
    from wristctl.identification.loop_shape import LoopShape

log = logging.getLogger(__name__)

# Parameters that may be held at a value.
_MAY_BE_FIXED = {"stiffness", "tendon_radius", "presliding", "inner_friction", "inner_presliding_deg"}
# Share of the presliding by which a loop may leap between two samples at its turns.
_COARSE = 0.25
# Share of the noise by which what is expected may change with the integration step.
_STEP_ERROR = 0.1
# Share of the dead band in pull, pull times exponent, by which pulls that drive a loop may tremble.
_TREMBLE = 0.01
# Ratio of an interval's ends beyond which a stiffness is not told.
_TOLD = 3.0
_FRICTION = Quantity("friction", "", "coefficient of the tendons' friction, mu", "friction coefficient")
_SHEATH = Quantity(
    "sheath", "rad", "angle by which a tendon is wrapped before it reaches the wrist",
    "sheath (angle of wrap before the wrist)",
)  # fmt: skip
_PRESLIDING = Quantity("presliding", "m", "path in which friction turns round", shown="um")
_STIFFNESS = Quantity("stiffness", "N m/rad", "bending stiffness of the whole wrist")
_INSIDE, _TURNS = "friction inside the wrist", "bend in which that turns round"
_INNER_FRICTION = Quantity("inner_friction", "N m", f"torque of {_INSIDE}", _INSIDE)
_INNER_PRESLIDING = Quantity("inner_presliding", "rad", _TURNS, _TURNS, "deg")
_RADIUS = Quantity("tendon_radius", "m", "radius of the tendons' circle", shown="mm")
_SLACK = [
    Quantity(name, "m", "reeled in before it pulls, over its spool's count", f"slack of the {side} side", "mm")
    for name, side in (("slack_plus", "+"), ("slack_minus", "-"))
]
# Parameters that the answer has where they were hardly known beforehand.
_FREED = (_STIFFNESS, *_SLACK)
_MISFIT = "variance of what is left over, over that of the samples' own noise"


@dataclass(frozen=True, repr=False, eq=False)
class LoopTold(StudyResult):
    """What a loop of hysteresis tells: friction of tendons and wrist, stiffness, radius and slack, with intervals."""

    kind = "identify"

    fits: Sequence[FrictionFit]
    """Fits that were tried, the chosen one last."""

    @property
    def fit(self) -> FrictionFit:
        """The chosen fit."""
        return self.fits[-1]

    @property
    def told(self) -> Mapping[str, Told]:
        """Each parameter, in SI units."""
        return _told(self.fit)

    @property
    def answer(self) -> Answer:
        """The loop's own shape, then what was found."""
        return loop_answer(self.fits, self.study.wrist, rest("All that was fitted", self.place))

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value and ends of its interval, nan where the loop does not tell it, and unit."""
        return told_frame(self.told)


def _problem(study: Study) -> LoopProblem:
    """The study's measured loop. Raises UserError for logs that are none."""
    from wristctl.identification.loop_problem import LoopProblem
    from wristctl.identification.measured_loop import loop_of

    logs = logs_of(study)
    if len(logs) > 1:
        problem = f"{len(logs)} logs, and a loop of hysteresis is one"
        raise UserError(problem, str(logs[1].file), "name its file alone; identify.trial names one of its trials")
    return LoopProblem(loop_of(logs[0], study.wrist, study.identify.trial), study.wrist, study.identify)


def loop_plan(study: Study) -> str:
    """Say what is looked for in which loop."""
    check_sides(study.wrist, "identify --model hysteresis")
    if odd := sorted(study.identify.fixed.keys() - _MAY_BE_FIXED):
        fix = f"one of {', '.join(sorted(_MAY_BE_FIXED))}"
        raise UserError(f"{odd[0]} of a loop of hysteresis cannot be held", f"identify.fix.{odd[0]}", fix)
    problem = _problem(study)
    return f"friction, sheath, presliding from {len(problem.measured[0])} samples of {problem.loop.name}"


def identify_loop(session: Session) -> LoopTold:
    """Fit friction to a measured loop, in its run; one that no model fits is refused, with all that was found."""
    from wristctl.commands.identify.figures import measured
    from wristctl.identification.friction_fit import fit_in_turn
    from wristctl.records.files import sha256_of

    findings, settings, source = session.findings, session.study.identify, Path(session.study.identify.logs[0])
    with session.progress("fitting the measured loop"):
        fits = fit_in_turn(_problem(session.study))
    fit = fits[-1]
    _warn(fit)
    findings.numerics(integrator="RODAS3", step=fit.problem.step, segments=settings.segments)
    findings.plain("data/source.json", {"name": source.name, "sha256": sha256_of(source)})
    _write(findings, fit)
    findings.figure("measured", measured, fit)
    keep_told(findings, _told(fit), n=fit.count)
    meaning = "of mu with bend + sheath, as logarithms, at the mean bend"
    findings.metric("correlation", fit.correlation, n=fit.count, meaning=meaning)
    findings.metric("misfit", fit.misfit, "", "lower", fit.count, meaning=_MISFIT)
    result = LoopTold(session.study, findings, [_tried_table(fits)], fits)
    if settings.misfit == "refuse" and fit.misfit > settings.lack_of_fit:
        session.tell_refused(result.answer, result.tables)
        worst = int(((fit.noise / fit.problem.noise) ** 2).argmax())
        sizes = (fit.noise[worst], fit.problem.noise[worst])
        model, samples = (f"{math.degrees(size):.2g} deg" if worst == 0 else f"{size:.2g} N" for size in sizes)
        problem = f"the best model is off by {model}, single samples by {samples}: it misses something"
        accept = ("look at the figure; or take it as it is: ", Setting("misfit=tell", "identify"))
        raise UserError(problem, fit.problem.loop.name, accept, exit_code=3)
    return result


def _warn(fit: FrictionFit) -> None:
    """Warn of what makes the fit less sure than its intervals say."""
    from wristctl.identification.intervals import ALIKE

    if fit.autocorrelation > ALIKE:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    if fit.step_error > _STEP_ERROR:
        advice = "the fit depends on the integration step: half of it changes the model by %.2g of the noise - fix: %s"
        log.warning(advice, fit.step_error, f"identify.step: {0.5 * fit.problem.step:g}")
    if fit.leap > _COARSE * fit.presliding.value:
        leap, path = 1e6 * fit.leap, 1e6 * fit.presliding.value
        advice = "the loop leaps %.2g um between two samples at its turns, and presliding is some %.2g um: %s - fix: %s"
        unsure, fix = "values may be off by more than their intervals", "sample more often, or turn more softly"
        log.warning(advice, leap, path, unsure, fix)
    loop = fit.problem.loop
    if loop.winch and loop.tremble > _TREMBLE * fit.exponent.value * float(loop.drive.mean()):
        advice = "the pulls that drive the loop tremble by %.2g N: presliding may come out too long - fix: %s"
        log.warning(advice, loop.tremble, "measure the spools' positions too, or hang weights")


def _tried_table(fits: Sequence[FrictionFit]) -> Table:
    """What each supposition leaves over."""
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


def _write(findings: Findings, fit: FrictionFit) -> None:
    columns = {"time": fit.problem.loop.time[fit.problem.first :]}
    names = ("theta", "tension_plus", "tension_minus")
    for name, samples, residual in zip(names, fit.problem.measured, fit.residuals, strict=False):
        columns |= {name: samples, f"{name}_model": samples - residual}
    units = {name: "s" if name == "time" else "rad" if name.startswith("theta") else "N" for name in columns}
    findings.table("data/measured.csv", columns, units)


def _found(fit: FrictionFit) -> list[tuple[Quantity, FrictionEstimate, bool]]:
    """Each parameter with its interval, and whether the loop tells it by itself."""
    (bend, exponent), apart, stiffness = fit.told_best, _told_apart(fit), fit.stiffness
    at = f"at a bend of {math.degrees(bend):.3g} deg"
    best, words = f"mu (bend + sheath) {at}, where it is told best", f"coefficient x (bend + sheath), {at}"
    found = [
        (_FRICTION, fit.friction, apart),
        (_SHEATH, fit.sheath, apart),
        (_PRESLIDING, fit.presliding, math.isfinite(fit.presliding.high)),
        (Quantity("exponent", "", best, words), exponent, True),
        (_STIFFNESS, stiffness, stiffness.high < _TOLD * stiffness.low),
    ]
    if fit.inner_friction is not None and fit.inner_presliding is not None:
        found.append((_INNER_FRICTION, fit.inner_friction, fit.inner_friction.low > 0.0))
        found.append((_INNER_PRESLIDING, fit.inner_presliding, True))
    if fit.problem.loop.winch:
        return found
    if fit.problem.supposed.freed:
        found.append((_RADIUS, fit.tendon_radius, True))
    return [*found, *((quantity, slack, True) for quantity, slack in zip(_SLACK, fit.slack, strict=True))]


def _told(fit: FrictionFit) -> dict[str, Told]:
    """Each parameter by name; one whose interval has no end is not told."""
    from wristctl.identification.arc_fit import Told

    return {quantity.name: Told(*estimate, quantity.unit, quantity.meaning) for quantity, estimate, _ in _found(fit)}


def _told_apart(fit: FrictionFit) -> bool:
    """Whether coefficient and sheath are each told by the loop, not only together."""
    return fit.friction.low > 0.0 and math.isfinite(fit.sheath.high)


def loop_answer(fits: Sequence[FrictionFit], wrist: WristParameters, more: str) -> Answer:
    """A measured loop by itself, then what was found, with a dash where the loop does not tell it.

    `fits` are those that were tried, the chosen one last. Where it does not fit, that is the first sentence.
    """
    from wristctl.identification.loop_shape import loop_shape

    fit = fits[-1]
    loop = fit.problem.loop
    sentence = _of_shape(loop.name, loop.winch, loop_shape(loop, wrist))
    if fit.misfit > fit.problem.settings.lack_of_fit:
        left = f"{degrees(float(fit.noise[0]))} deg of angle over, {two(fit.misfit**0.5)} times the samples' own noise"
        sentence = f"Nothing to rely on: the best model leaves {left}. {sentence}"
    rows = []
    for quantity, estimate, told in _found(fit):
        if fit.problem.supposed.freed or quantity not in _FREED:
            value, low, high = (two(quantity.cell(end), 3) for end in estimate)
            cells = (value, f"{low} to {high}", quantity.shown or quantity.unit) if told else ("-", "-", "")
            rows.append((quantity.words, *cells))
    return Answer(sentence, Table("", ("parameter", "value", "95 % interval", "unit"), rows), _notes(fits), more)


def _of_shape(name: str, winch: bool, shape: LoopShape) -> str:
    """Width, work and slope as far as the columns give them; `winch`: only pulls at the spools are known."""
    parts = []
    if shape.width is not None:
        same = "pulls" if winch else "spools"
        parts.append(f"at the same {same} the angles out and back are {degrees(abs(shape.width))} deg apart")
    if shape.work is not None:
        mean = f" (mean of {shape.cycles})" if shape.cycles > 1 else ""
        parts.append(f"a cycle takes {two(1e3 * shape.work, 3)} mJ at the spools{mean}")
    if shape.stiffness is not None:
        parts.append(f"the pulls' torque rises by {two(shape.stiffness, 3)} N m/rad")
    if shape.gain is not None:
        parts.append(f"the wrist bends by {two(math.degrees(1e-3 * shape.gain), 3)} deg for 1 mm reeled in")
    return f"The loop of {name} by itself: {', '.join(parts)}." if parts else f"{name} holds no stroke there and back."


def _wanted(fits: Sequence[FrictionFit]) -> list[str]:
    """What the data want beyond the friction of tendons, in words."""
    chosen, left = fits[-1], [(fit.problem.supposed, degrees(float(fit.noise[0]))) for fit in fits]
    if len(fits) == 1:
        return []
    steps = ", ".join(f"{supposed.words}: {size} deg" for supposed, size in sorted(left, key=lambda pair: pair[0][1:]))
    wants = "friction inside the wrist" if chosen.problem.supposed.inner else "another stiffness, radius or slack"
    return [f"The loop wants {wants}. Left over with {steps}."]


def _notes(fits: Sequence[FrictionFit]) -> list[str]:
    fit = fits[-1]
    angle, *tensions = fit.noise
    left = f"{degrees(float(angle))} deg of angle"
    if tensions:
        left += f" and {two(float(max(tensions)))} N of tension"
    notes = [f"The model leaves over (standard deviation) {left}, of {fit.count} samples.", *_wanted(fits)]
    if not _told_apart(fit):
        most, least = two(fit.friction.high, 3), two(math.degrees(fit.sheath.low), 3)
        notes.append(
            f"The loop tells coefficient and sheath only together: the coefficient may be up to {most}, the sheath "
            f"{least} deg or more. A wider range of bend would tell them apart."
        )
    if not math.isfinite(fit.presliding.high):
        notes.append("The loop does not tell presliding. More samples at its turns would.")
    return notes
