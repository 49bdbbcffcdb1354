"""The answer of a study of hysteresis: a measured loop's own shape and fit, or the dead band of the wrist as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.hysteresis.tables import LOOPS, record_of, still_change
from wristctl.commands.printed_table import Table, degrees, two
from wristctl.commands.quantities import Quantity, table_of
from wristctl.wrist.directions import toward_words

if TYPE_CHECKING:
    from wristctl.config.wrist import WristParameters
    from wristctl.identification.friction_fit import FrictionEstimate, FrictionFit
    from wristctl.identification.loop_shape import LoopShape
    from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop
    from wristctl.simulation.hysteresis_circles import HysteresisCircle
    from wristctl.simulation.strokes import FrictionCase

# Rows that a table may have; of more, those of the main coefficient of friction.
_ROWS = 14
# Quantities of a row beside its dead band.
_OF_A_ROW = ("friction", "sheath", "width", "friction_work", "damped_work")
# Ratio of an interval's ends beyond which a stiffness is not told.
_TOLD = 3.0


def measured_answer(fits: Sequence[FrictionFit], wrist: WristParameters, more: str) -> Answer:
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
    heads = ("parameter", "value", "95 % interval", "unit")
    return Answer(sentence, Table("", heads, _fitted(fit)), _notes(fits), more)


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


def _told_apart(fit: FrictionFit) -> bool:
    """Whether coefficient and sheath are each told by the loop, not only together."""
    return fit.friction.low > 0.0 and math.isfinite(fit.sheath.high)


def _fitted(fit: FrictionFit) -> list[tuple[str, str, str, str]]:
    bend, exponent = fit.told_best
    apart = _told_apart(fit)
    return [
        _row("friction coefficient", fit.friction, "", apart),
        _row("sheath (angle of wrap before the wrist)", fit.sheath, "rad", apart),
        _row("presliding", fit.presliding, "um", math.isfinite(fit.presliding.high), 1e6),
        _row(f"coefficient x (bend + sheath), at a bend of {math.degrees(bend):.3g} deg", exponent, "", True),
        *_of_the_wrist(fit),
    ]


def _of_the_wrist(fit: FrictionFit) -> list[tuple[str, str, str, str]]:
    """Rows of stiffness, inner friction, radius and slack, where they were found."""
    rows = []
    if fit.inner_friction is not None and fit.inner_presliding is not None:
        rows += [
            _row("friction inside the wrist", fit.inner_friction, "N m", fit.inner_friction.low > 0.0),
            _row("bend in which that turns round", fit.inner_presliding, "deg", True, math.degrees(1.0)),
        ]
    if fit.problem.supposed.freed:
        stiffness = fit.stiffness
        rows.append(_row("stiffness", stiffness, "N m/rad", stiffness.high < _TOLD * stiffness.low))
        if not fit.problem.loop.winch:
            rows.append(_row("tendon radius", fit.tendon_radius, "mm", True, 1e3))
            names = ("slack of the + side", "slack of the - side")
            rows += [_row(name, slack, "mm", True, 1e3) for name, slack in zip(names, fit.slack, strict=True)]
    return rows


def _row(name: str, estimate: FrictionEstimate, unit: str, told: bool, scale: float = 1.0) -> tuple[str, str, str, str]:
    value, low, high = (two(scale * end, 3) for end in estimate)
    return (name, value, f"{low} to {high}", unit) if told else (name, "-", "-", "")


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


def model_answer(
    driven: Sequence[HysteresisLoop], bands: Sequence[DeadBand], around: Sequence[HysteresisCircle],
    main: FrictionCase, more: str, why_two: str = "",
) -> Answer:  # fmt: skip
    """Dead band, width and works of the wrist at its main friction, beside other coefficients and sheaths.

    `why_two` says why it bends in two planes; it is empty where it does not.
    """
    first = driven[0].case
    outer = [loop for loop in driven if (loop.case.low, loop.case.high) == (first.low, first.high)]
    slowest = min(loop.case.frequency for loop in outer)
    slow = [loop for loop in outer if loop.case.frequency == slowest]
    own = next(loop for loop in slow if loop.case.tendons == main)
    rows = [loop for loop in slow if loop.case.tendons.presliding == main.presliding]
    if len(rows) > _ROWS:
        rows = [loop for loop in rows if loop.case.tendons.friction == main.friction][:_ROWS]
    held = {band.tendons: band for band in _middle(bands)}
    quantities = [quantity for quantity in LOOPS if quantity.name in _OF_A_ROW]
    quantities.insert(2, Quantity("dead_band", "rad"))
    records = [
        record_of(loop) | {"dead_band": band.width if (band := held.get(loop.case.tendons)) else None} for loop in rows
    ]
    notes = [f"Width and works are of a cycle at {slowest:g} Hz, with a presliding of {1e6 * main.presliding:g} um."]
    every: list[HysteresisLoop | DeadBand | HysteresisCircle] = [*driven, *bands, *around]
    if open_ := still_change(every):
        parts = "loops, dead bands and circles" if around else "loops and dead bands"
        notes.append(f"Do not rely on all of them: {open_} of {len(every)} {parts} have not converged (--all).")
    if slow_circles := [circle for circle in around if circle.case.tendons == main]:
        circle = min(slow_circles, key=lambda each: each.case.frequency)
        notes.append(
            f"On a circle of {math.degrees(circle.case.radius):g} deg at {circle.case.frequency:g} Hz it comes "
            f"{degrees(circle.lag, 3)} deg behind, and friction takes {two(1e3 * circle.friction_work, 3)} mJ a turn."
        )
    if why_two:
        toward = math.degrees(math.atan2(own.toward[1], own.toward[0])) % 360.0
        aside = f"friction takes the wrist off that line by {degrees(own.aside, 3)} deg at most"
        notes.append(f"In two planes ({why_two}), bent {toward_words(toward)}; {aside}.")
    return Answer(_of_wrist(own, held.get(main)), table_of("", quantities, records), notes, more)


def _middle(bands: Sequence[DeadBand]) -> list[DeadBand]:
    """The dead band at the middle one of the angles, of each friction."""
    by_case: dict[FrictionCase, list[DeadBand]] = {}
    for band in bands:
        by_case.setdefault(band.tendons, []).append(band)
    return [some[len(some) // 2] for some in by_case.values()]


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
