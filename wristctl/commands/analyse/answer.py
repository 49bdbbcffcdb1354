"""Result of the analysis of a loop in words and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, joined, number
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    from wristctl.stability.linear_range import LinearityLimit
    from wristctl.stability.loop_analysis import LoopAnalysis, RootLocus
    from wristctl.stability.margins import Crossing
    from wristctl.stability.phase_portrait import PhasePortrait


_HZ = 1.0 / (2.0 * math.pi)
# Place at which the loop is cut, by the sensor's level: the same loop on both sides of motors and wrist.
CUTS = {
    "ideal": "the law's torque (ideal sensing)",
    "camera": "the camera's frames",
}

# Name of the limit of linearity that only adds to a swing.
NOISE = "the camera's noise"


def decibels(factor: float) -> float:
    """A factor of the gain in dB; -inf for 0."""
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def listed(angles: Iterable[float]) -> str:
    """Angles [deg] as text: 0, 15 and 30 deg."""
    texts = [f"{round(angle, 6):g}" for angle in angles]
    return f"{joined(texts)} deg"


def answer(label: str, analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> str:
    """The answer in a sentence, with the least margin of all resting angles [deg]."""
    if all(analysis.is_open for analysis in analyses):
        stays = all(analysis.margins.stable for analysis in analyses)
        sentence = f"{label} feeds nothing back: there is no loop, and no margin; the plant alone is shown"
        return sentence if stays else f"{sentence}, and it is UNSTABLE"
    bad = [k for k, analysis in enumerate(analyses) if not analysis.margins.stable]
    if bad:
        worst = max((analyses[k] for k in bad), key=lambda analysis: analysis.margins.growth)
        swing = worst.linear.closed.modes()[0].frequency
        sentence = f"{label} is UNSTABLE at {listed(angles[k] for k in bad)}: a swing of {_three(swing)} Hz"
        return f"{sentence} grows by e in {_time(1.0 / worst.margins.growth)}; {_mended(worst)}"
    parts = [_gain_margin(analyses), *_of_each_plane(analyses), _delay_margin(analyses)]
    sensitivity = max(analysis.margins.sensitivity.value for analysis in analyses)
    step = max(analyses, key=lambda analysis: analysis.step.settling).step
    parts += [
        f"largest sensitivity {_three(sensitivity)}",
        f"a step settles in {_time(step.settling)} with {_three(100.0 * step.overshoot)} % overshoot",
        *_linear_range(analyses[-1]),
    ]
    return f"{label} is stable at {listed(angles)}: {', '.join(parts)}"


def on_a_screen(label: str, sentence: str, analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Answer:
    """The answer for one screen; `sentence` is that of `answer`, which an unstable or an open loop begins with."""
    is_open = all(analysis.is_open for analysis in analyses)
    stable = all(analysis.margins.stable for analysis in analyses)
    more = "Root locus, limits of linearity and all columns: --all."
    if is_open or not stable:
        return Answer(f"{sentence}.", None if is_open else _screen_table(analyses, angles), (), more)
    most = min(analysis.margins.most.value for analysis in analyses)
    least = max(analysis.margins.least.value for analysis in analyses)
    delay = min(analysis.margins.delay for analysis in analyses)
    gain = (
        f"gain margin {_three(decibels(most))} dB ({_three(most)} times the loop gain)"
        if math.isfinite(most)
        else "any larger loop gain is stable"
    )
    margin = f"delay margin {_time(delay)}" if math.isfinite(delay) else "any delay is stable"
    first = f"{label} is stable at {listed(angles)}: {gain}, {margin}."
    notes = [f"Below {_three(least)} times the loop gain it is unstable."] * (least > 0.0)
    notes += [f"Margins are of both planes together; {each}." for each in _of_each_plane(analyses)]
    for swings in _linear_range(analyses[-1]):
        holds = f"these margins hold {swings}" if swings.startswith("for ") else swings.removeprefix("and yet ")
        notes.append(f"At {listed(angles[-1:])} {holds}.")
    return Answer(first, _screen_table(analyses, angles), notes, more)


def _screen_table(analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """Margins and step of each resting angle: what everybody needs of them; a dash where the loop is unstable."""
    columns = (
        "at rest [deg]", "gain margin [dB]", "phase margin [deg]", "delay margin [ms]", "settling [ms]",
        "overshoot [%]",
    )  # fmt: skip
    rows = []
    for angle, analysis in zip(angles, analyses, strict=True):
        margins, step = analysis.margins, analysis.step
        values = (
            decibels(margins.most.value), math.degrees(margins.phase.value), 1e3 * margins.delay,
            1e3 * step.settling, 100.0 * step.overshoot,
        )  # fmt: skip
        rows.append((angle, *(value if margins.stable else None for value in values)))
    return Table("", columns, rows)


def _gain_margin(analyses: Sequence[LoopAnalysis]) -> str:
    most = min((analysis.margins.most for analysis in analyses), key=lambda crossing: crossing.value)
    least = max((analysis.margins.least for analysis in analyses), key=lambda crossing: crossing.value)
    sentence = f"gain margin {_three(decibels(most.value))} dB" if math.isfinite(most.value) else "no gain is too large"
    limits = [_times(crossing) for crossing in (most, least) if 0.0 < crossing.value < math.inf]
    return f"{sentence} (begins to oscillate at {', and at '.join(limits)})" if limits else sentence


def _times(limit: Crossing) -> str:
    return f"{_three(limit.value)} times the loop gain, with {_three(_HZ * limit.omega)} Hz"


def _of_each_plane(analyses: Sequence[LoopAnalysis]) -> list[str]:
    """What each of two planes bears by itself, in words."""
    if analyses[0].linear.planes == 1:
        return []
    each = max((analysis.margins for analysis in analyses), key=lambda margins: margins.sensitivity.value).of_each
    factors = f"{_three(each.least)} to {_three(each.most)} times its gain"
    return [f"each plane by itself bears {factors}, or a phase of {_three(math.degrees(each.phase))} deg"]


def _delay_margin(analyses: Sequence[LoopAnalysis]) -> str:
    least = min((analysis.margins for analysis in analyses), key=lambda margins: margins.delay)
    return "no delay is too long" if math.isinf(least.delay) else f"delay margin {_time(least.delay)}"


def _linear_range(analysis: LoopAnalysis) -> list[str]:
    """Swings for which the loop is linear, in words; noise only adds to them."""
    finite = [limit for limit in analysis.limits if math.isfinite(limit.swing) and limit.what != NOISE]
    low = max((limit for limit in finite if not limit.above), key=lambda limit: limit.swing, default=None)
    high = min((limit for limit in finite if limit.above), key=lambda limit: limit.swing, default=None)
    ends = [_end(limit, "above" if limit is low else "below") for limit in (low, high) if limit is not None]
    if low is not None and high is not None and low.swing >= high.swing:
        return [f"and yet no swing is linear, which it would be {' and '.join(ends)}"]
    return [f"for swings {' and '.join(ends)}"] if ends else []


def _end(limit: LinearityLimit, side: str) -> str:
    return f"{side} {_three(math.degrees(limit.swing))} deg ({limit.what})"


def _mended(worst: LoopAnalysis) -> str:
    least, most = worst.margins.least, worst.margins.most
    if math.isnan(least.value):
        return "no other loop gain makes it stable"
    if least.value == 0.0:
        return f"it is stable up to {_three(most.value)} times the loop gain"
    above = "" if math.isinf(most.value) else f" to {_three(most.value)}"
    return f"it is stable from {_three(least.value)}{above} times the loop gain"


def _time(seconds: float) -> str:
    return f"{_three(seconds)} s" if seconds >= 1.0 else f"{_three(1e3 * seconds)} ms"


def _three(value: float) -> str:
    return f"{value:.3g}"


def margin_table(title: str, analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """Table of margins with a row for each resting angle; `title` is the answer in words."""
    columns = (
        "rests at [deg]", "torque [N m]", "stable", "gain margin [dB]", "at [Hz]", "least factor", "phase margin [deg]",
        "delay margin [ms]", "at [Hz] ", "Ms", "Mt",
    )  # fmt: skip
    rows = [
        (
            angle, round(_torque(analysis), 12), analysis.margins.stable, decibels(analysis.margins.most.value),
            _HZ * analysis.margins.most.omega, analysis.margins.least.value, math.degrees(analysis.margins.phase.value),
            1e3 * analysis.margins.delay, _HZ * analysis.margins.delay_omega, analysis.margins.sensitivity.value,
            analysis.margins.complementary.value,
        )
        for angle, analysis in zip(angles, analyses, strict=True)
    ]  # fmt: skip
    return Table(title, columns, rows)


def _torque(analysis: LoopAnalysis) -> float:
    """Torque at rest [N m]; over two planes its size."""
    torque = analysis.linear.torque
    return torque if analysis.linear.planes == 1 else math.hypot(*torque)


def each_plane_table(analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """Table of what each of two planes bears by itself, whatever the other bears, a row for each resting angle."""
    columns = ("rests at [deg]", "least factor", "largest factor", "phase [deg]")
    rows = []
    for angle, analysis in zip(angles, analyses, strict=True):
        each, stable = analysis.margins.of_each, analysis.margins.stable
        values = each.least, each.most, math.degrees(each.phase)
        rows.append((angle, *(value if stable else None for value in values)))
    return Table("What each plane bears by itself, by the largest sensitivity", columns, rows)


def step_table(analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """Table of the closed loop's response to a small step of its reference, a row for each resting angle."""
    columns = ("rests at [deg]", "rise 10-90 % [ms]", "overshoot [%]", "settling 2 % [ms]", "arrives at [%]")
    rows = [
        (
            angle,
            1e3 * analysis.step.rise,
            100.0 * analysis.step.overshoot,
            1e3 * analysis.step.settling,
            100.0 * analysis.step.final,
        )
        for angle, analysis in zip(angles, analyses, strict=True)
    ]
    return Table("A small step of the reference", columns, rows)


def limit_table(analysis: LoopAnalysis, cut: str) -> Table:
    """Table of the swings at which linearisation fails, at one resting angle; the loop is cut at `cut`."""
    rows = [
        (limit.what, f"{'above' if limit.above else 'below'} {number(math.degrees(limit.swing))}", limit.read_as)
        if math.isfinite(limit.swing)
        else (limit.what, "-", limit.read_as)
        for limit in analysis.limits
    ]
    title = f"Where linearisation says nothing; the loop is cut at {cut}"
    return Table(title, ("because of", "swings of the wrist [deg]", "linearised as"), rows)


def locus_table(locus: RootLocus, value: float | None, unit: str, span: float) -> Table:
    """Within which values of a gain the loop is stable, as far as that was looked at."""
    heads = ("over", "value", "stable from", "with [Hz]", "up to", "with [Hz] ")
    least, most = (factor if value is None else value * factor for factor in (locus.least, locus.most))
    name = "the loop's gain, as a factor" if value is None else f"{locus.over} [{unit}]" if unit else locus.over
    low, high = locus.swings
    limits = (None if least == 0.0 else least, low, None if math.isinf(most) else most, high)
    return Table(
        f"Root locus, from 1/{span:g} to {span:g} times", heads, [(name, 1.0 if value is None else value, *limits)]
    )


def portrait_table(portrait: PhasePortrait) -> Table:
    """Table of reaching time and largest error of each course to the sliding surface."""
    rows = [
        (math.degrees(course.error[0]), 1e3 * course.reached, math.degrees(abs(course.error).max()), course.sigma[-1])
        for course in portrait.courses
    ]
    heads = ("begins with an error of [deg]", "reaching [ms]", "largest error [deg]", "sigma at the end")
    slope = f"Sliding surface: de/dt = -{number(portrait.slope)} e; its boundary layer is"
    return Table(f"{slope} {number(portrait.layer)} rad/s wide to either side", heads, rows)


# Columns of the main table with unit and meaning.
_MARGINS: dict[str, tuple[str, str]] = {
    "angle_deg": ("deg", "where the loop rests, toward the direction"),
    "torque": ("N m", "that holds it there"),
    "stable": ("", "whether small swings die out"),
    "growth": ("1/s", "of the least stable mode"),
    "gain_most": ("", "factor of the loop's gain up to which it is stable"),
    "gain_most_frequency": ("Hz", "with which it begins to oscillate there"),
    "gain_least": ("", "factor of the loop's gain down to which it is stable"),
    "gain_least_frequency": ("Hz", "with which it begins to oscillate there"),
    "phase_margin": ("rad", "smallest where the loop gain is 1"),
    "delay_margin": ("s", "least delay more that makes it unstable"),
    "delay_frequency": ("Hz", "with which it begins to oscillate then"),
    "sensitivity": ("", "Ms, largest |1/(1 + L)|"),
    "complementary": ("", "Mt, largest |L/(1 + L)|"),
    "rise": ("s", "of a small step from 10 to 90 %"),
    "overshoot": ("", "of a small step, as a share of where it ends"),
    "settling": ("s", "of a small step to 2 %"),
    "final": ("", "share of a small step at which the angle arrives"),
}


# Columns that are added in two planes.
_OF_TWO: dict[str, tuple[str, str]] = {
    "toward_deg": ("deg", "direction of the resting bend, from ulnar toward flexion"),
    "each_least": ("", "factor of one plane's gain down to which it is stable, whatever the other's up to its own"),
    "each_most": ("", "factor of one plane's gain up to which it is stable, whatever the other's up to its own"),
    "each_phase": ("rad", "phase that each plane bears by itself"),
}


def margins_of(angle: float, analysis: LoopAnalysis, toward_deg: float | None = None) -> dict[str, float]:
    """A row of the main table; inf where there is no limit. In two planes the wrist rests toward a direction [deg]."""
    margins, step = analysis.margins, analysis.step
    values = (
        angle, _torque(analysis), margins.stable, margins.growth, margins.most.value, _HZ * margins.most.omega,
        margins.least.value, _HZ * margins.least.omega, margins.phase.value, margins.delay, _HZ * margins.delay_omega,
        margins.sensitivity.value, margins.complementary.value, step.rise, step.overshoot, step.settling, step.final,
    )  # fmt: skip
    row = dict(zip(_MARGINS, values, strict=True))
    return row if toward_deg is None else row | dict(zip(_OF_TWO, (toward_deg, *margins.of_each), strict=True))


class LoopResults(NamedTuple):
    """Results of the analysis of one loop."""

    angles: Sequence[float]
    """Resting angles [deg]."""
    analyses: Sequence[LoopAnalysis]
    """Analysis at each resting angle."""
    locus: RootLocus | None
    """Root locus at the last angle; None where nothing is fed back."""
    portrait: PhasePortrait | None
    """Phase portrait of a sliding law; None of another law."""
    toward_deg: float | None
    """Direction of the resting bends [deg]; None in one plane."""


def write(findings: Findings, results: LoopResults) -> None:
    """Write the worst margins of all resting angles as metrics, and all results as tables."""
    import numpy as np
    import pandas as pd

    angles, analyses, locus, portrait, toward_deg = results
    rows = pd.DataFrame([margins_of(*row, toward_deg) for row in zip(angles, analyses, strict=True)])
    worst: dict[str, tuple[Literal["lower", "higher"], float]] = {
        "gain_most": ("higher", rows["gain_most"].min()), "gain_least": ("lower", rows["gain_least"].max()),
        "delay_margin": ("higher", rows["delay_margin"].min()), "sensitivity": ("lower", rows["sensitivity"].max()),
        "complementary": ("lower", rows["complementary"].max()), "overshoot": ("lower", rows["overshoot"].max()),
        "settling": ("lower", rows["settling"].max()), "growth": ("lower", rows["growth"].max()),
    }  # fmt: skip
    for name, (better, value) in worst.items():
        unit, meaning = _MARGINS[name]
        shown = float(value) if all(analysis.margins.stable for analysis in analyses) or name == "growth" else math.nan
        description = f"{meaning}; the worst of all resting angles"
        findings.metric(name, shown if math.isfinite(shown) else None, unit, better, len(analyses), meaning=description)
    columns = _MARGINS if toward_deg is None else _MARGINS | _OF_TWO
    units, meanings = ({name: column[k] for name, column in columns.items()} for k in range(2))
    findings.table("data/margins.csv", rows, units, meanings)
    curves = [
        pd.DataFrame(
            {
                "angle_deg": angle, **({} if toward_deg is None else {"locus": number}),
                "frequency": _HZ * analysis.omega, "gain": np.abs(curve), "phase": np.unwrap(np.angle(curve)),
                "plant_gain": np.abs(plant), "plant_phase": np.unwrap(np.angle(plant)),
            }
        )
        for angle, analysis in zip(angles, analyses, strict=True)
        for number, (curve, plant) in enumerate(zip(analysis.loci, analysis.plant_loci, strict=True), 1)
    ]  # fmt: skip
    response_units = {
        "angle_deg": "deg",
        "frequency": "Hz",
        "phase": "rad",
        "plant_gain": "rad/(N m)",
        "plant_phase": "rad",
    }
    of_response = {"gain": "of the loop's transfer"}
    if toward_deg is not None:
        of_response = {"gain": "of an eigenvalue of the loop's transfer", "locus": "number of the eigenvalue"}
    findings.table("data/response.csv", pd.concat(curves), response_units, of_response)
    steps = [
        pd.DataFrame({"angle_deg": angle, "time": analysis.step.time, "response": analysis.step.angle})
        for angle, analysis in zip(angles, analyses, strict=True)
    ]
    findings.table("data/step.csv", pd.concat(steps), {"angle_deg": "deg", "time": "s"}, {"response": "angle per step"})
    if locus is not None:
        every = [
            pd.DataFrame({"factor": factor, "growth": poles[:, 0], "frequency": poles[:, 1]})
            for factor, poles in zip(locus.factors, locus.poles, strict=True)
        ]
        findings.table("data/locus.csv", pd.concat(every), {"growth": "1/s", "frequency": "Hz"}, {"factor": locus.over})
    if portrait is not None:
        courses = [
            pd.DataFrame(
                {"course": k, "time": course.time, "error": course.error, "rate": course.rate, "sigma": course.sigma}
            )
            for k, course in enumerate(portrait.courses)
        ]
        portrait_units = {"time": "s", "error": "rad", "rate": "rad/s"}
        findings.table("data/portrait.csv", pd.concat(courses), portrait_units, {"sigma": "0 on the sliding surface"})


def draw(findings: Findings, label: str, results: LoopResults) -> None:
    """Draw the Bode plot first; of a loop that feeds nothing back, the plant's. `label` names the law and its gains."""
    from wristctl.commands.analyse import figures

    angles, analyses, locus, portrait, _ = results
    heading = f"{label}: the plant, angle per torque" if locus is None else f"{label}: loop transfer"
    findings.figure("bode", figures.bode, analyses, angles, heading)
    if any(analysis.margins.stable for analysis in analyses):
        findings.figure("step", figures.step, analyses, angles)
    if locus is not None:
        findings.figure("sensitivity", figures.sensitivity, analyses, angles)
        findings.figure("locus", figures.locus, locus)
    if portrait is not None:
        findings.figure("portrait", figures.portrait, portrait)
