"""What the analysis of a loop comes to, in words and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

from wristctl.commands.printed_table import Table, number
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    from wristctl.stability.linear_range import LinearityLimit
    from wristctl.stability.loop_analysis import LoopAnalysis, RootLocus
    from wristctl.stability.margins import Crossing
    from wristctl.stability.phase_portrait import PhasePortrait


_HZ = 1.0 / (2.0 * math.pi)
CUTS = {
    "ideal": "the law's torque (ideal sensing)",
    "camera": "the camera's frames",
}
"""Where the loop is cut, by the sensor's level: the same loop on both sides of motors and wrist."""


NOISE = "the camera's noise"
"""The limit of linearity that only adds to a swing."""


def decibels(factor: float) -> float:
    """A factor of the gain in dB; -inf for 0."""
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def listed(angles: Iterable[float]) -> str:
    """Angles [deg] as text: 0, 15 and 30 deg."""
    texts = [f"{round(each, 6):g}" for each in angles]
    *others, last = texts
    return f"{', '.join(others)} and {last} deg" if others else f"{last} deg"


def answer(label: str, found: Sequence[LoopAnalysis], angles: Sequence[float]) -> str:
    """The answer in a sentence, with the least margin of all resting angles [deg]."""
    if all(each.is_open for each in found):
        stays = all(each.margins.stable for each in found)
        told = f"{label} feeds nothing back: there is no loop, and no margin; the plant alone is shown"
        return told if stays else f"{told}, and it is UNSTABLE"
    bad = [k for k, each in enumerate(found) if not each.margins.stable]
    if bad:
        worst = max((found[k] for k in bad), key=lambda each: each.margins.growth)
        swing = worst.linear.closed.modes()[0].frequency
        told = f"{label} is UNSTABLE at {listed(angles[k] for k in bad)}: a swing of {_three(swing)} Hz"
        return f"{told} grows by e in {_time(1.0 / worst.margins.growth)}; {_mended(worst)}"
    parts = [_gain_margin(found), _delay_margin(found)]
    sensitivity = max(each.margins.sensitivity.value for each in found)
    step = max(found, key=lambda each: each.step.settling).step
    parts += [
        f"largest sensitivity {_three(sensitivity)}",
        f"a step settles in {_time(step.settling)} with {_three(100.0 * step.overshoot)} % overshoot",
        *_linear_range(found[-1]),
    ]
    return f"{label} is stable at {listed(angles)}: {', '.join(parts)}"


def _gain_margin(found: Sequence[LoopAnalysis]) -> str:
    most = min((each.margins.most for each in found), key=lambda each: each.value)
    least = max((each.margins.least for each in found), key=lambda each: each.value)
    told = f"gain margin {_three(decibels(most.value))} dB" if math.isfinite(most.value) else "no gain is too large"
    limits = [_times(each) for each in (most, least) if 0.0 < each.value < math.inf]
    return f"{told} (begins to oscillate at {', and at '.join(limits)})" if limits else told


def _times(limit: Crossing) -> str:
    return f"{_three(limit.value)} times the loop gain, with {_three(_HZ * limit.omega)} Hz"


def _delay_margin(found: Sequence[LoopAnalysis]) -> str:
    least = min((each.margins for each in found), key=lambda each: each.delay)
    return "no delay is too long" if math.isinf(least.delay) else f"delay margin {_time(least.delay)}"


def _linear_range(found: LoopAnalysis) -> list[str]:
    """For which swings that holds; noise only adds to them."""
    known = [each for each in found.limits if math.isfinite(each.swing) and each.what != NOISE]
    low = max((each for each in known if not each.above), key=lambda each: each.swing, default=None)
    high = min((each for each in known if each.above), key=lambda each: each.swing, default=None)
    ends = [_end(each, "above" if each is low else "below") for each in (low, high) if each is not None]
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


def margin_table(said: str, found: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """What was found in words, and below it a row for each resting angle."""
    columns = (
        "rests at [deg]", "torque [N m]", "stable", "gain margin [dB]", "at [Hz]", "least factor", "phase margin [deg]",
        "delay margin [ms]", "at [Hz] ", "Ms", "Mt",
    )  # fmt: skip
    rows = [
        (
            angle, round(each.linear.torque, 12), each.margins.stable, decibels(each.margins.most.value),
            _HZ * each.margins.most.omega, each.margins.least.value, math.degrees(each.margins.phase.value),
            1e3 * each.margins.delay, _HZ * each.margins.delay_omega, each.margins.sensitivity.value,
            each.margins.complementary.value,
        )
        for angle, each in zip(angles, found, strict=True)
    ]  # fmt: skip
    return Table(said, columns, rows)


def step_table(found: Sequence[LoopAnalysis], angles: Sequence[float]) -> Table:
    """What each closed loop makes of a small step of its reference."""
    columns = ("rests at [deg]", "rise 10-90 % [ms]", "overshoot [%]", "settling 2 % [ms]", "arrives at [%]")
    rows = [
        (angle, 1e3 * each.step.rise, 100.0 * each.step.overshoot, 1e3 * each.step.settling, 100.0 * each.step.final)
        for angle, each in zip(angles, found, strict=True)
    ]
    return Table("A small step of the reference", columns, rows)


def limit_table(found: LoopAnalysis, cut: str) -> Table:
    """Where linearisation says nothing, at one angle, of a loop that is cut there."""
    rows = [
        (each.what, f"{'above' if each.above else 'below'} {number(math.degrees(each.swing))}", each.read_as)
        if math.isfinite(each.swing)
        else (each.what, "-", each.read_as)
        for each in found.limits
    ]
    title = f"Where linearisation says nothing; the loop is cut at {cut}"
    return Table(title, ("because of", "swings of the wrist [deg]", "linearised as"), rows)


def locus_table(locus: RootLocus, value: float | None, unit: str, span: float) -> Table:
    """Within which values of a gain the loop is stable, as far as that was looked at."""
    heads = ("over", "value", "stable from", "with [Hz]", "up to", "with [Hz] ")
    least, most = (each if value is None else value * each for each in (locus.least, locus.most))
    name = "the loop's gain, as a factor" if value is None else f"{locus.over} [{unit}]" if unit else locus.over
    low, high = locus.swings
    limits = (None if least == 0.0 else least, low, None if math.isinf(most) else most, high)
    return Table(
        f"Root locus, from 1/{span:g} to {span:g} times", heads, [(name, 1.0 if value is None else value, *limits)]
    )


def portrait_table(portrait: PhasePortrait) -> Table:
    """How each course comes to the sliding surface."""
    rows = [
        (math.degrees(each.error[0]), 1e3 * each.reached, math.degrees(abs(each.error).max()), each.sigma[-1])
        for each in portrait.courses
    ]
    heads = ("begins with an error of [deg]", "reaching [ms]", "largest error [deg]", "sigma at the end")
    slope = f"Sliding surface: de/dt = -{number(portrait.slope)} e; its boundary layer is"
    return Table(f"{slope} {number(portrait.layer)} rad/s wide to either side", heads, rows)


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
"""Columns of the main table with unit and meaning."""


def margins_of(angle: float, found: LoopAnalysis) -> dict[str, float]:
    """A row of the main table; inf where there is no limit."""
    own, step = found.margins, found.step
    values = (
        angle, found.linear.torque, own.stable, own.growth, own.most.value, _HZ * own.most.omega, own.least.value,
        _HZ * own.least.omega, own.phase.value, own.delay, _HZ * own.delay_omega, own.sensitivity.value,
        own.complementary.value, step.rise, step.overshoot, step.settling, step.final,
    )  # fmt: skip
    return dict(zip(_MARGINS, values, strict=True))


def write(
    findings: Findings, angles: Sequence[float], found: Sequence[LoopAnalysis], locus: RootLocus | None,
    portrait: PhasePortrait | None,
) -> None:  # fmt: skip
    """The worst of all angles as metrics, and everything as tables."""
    import numpy as np
    import pandas as pd

    rows = pd.DataFrame([margins_of(*each) for each in zip(angles, found, strict=True)])
    worst: dict[str, tuple[Literal["lower", "higher"], float]] = {
        "gain_most": ("higher", rows["gain_most"].min()), "gain_least": ("lower", rows["gain_least"].max()),
        "delay_margin": ("higher", rows["delay_margin"].min()), "sensitivity": ("lower", rows["sensitivity"].max()),
        "complementary": ("lower", rows["complementary"].max()), "overshoot": ("lower", rows["overshoot"].max()),
        "settling": ("lower", rows["settling"].max()), "growth": ("lower", rows["growth"].max()),
    }  # fmt: skip
    for name, (better, value) in worst.items():
        unit, meaning = _MARGINS[name]
        known = float(value) if all(each.margins.stable for each in found) or name == "growth" else math.nan
        told = f"{meaning}; the worst of all resting angles"
        findings.metric(name, known if math.isfinite(known) else None, unit, better, len(found), meaning=told)
    units, meanings = ({name: each[k] for name, each in _MARGINS.items()} for k in range(2))
    findings.table("data/margins.csv", rows, units, meanings)
    curves = [
        pd.DataFrame(
            {
                "angle_deg": angle, "frequency": _HZ * each.omega, "gain": np.abs(each.response),
                "phase": np.unwrap(np.angle(each.response)), "plant_gain": np.abs(each.plant),
                "plant_phase": np.unwrap(np.angle(each.plant)),
            }
        )
        for angle, each in zip(angles, found, strict=True)
    ]  # fmt: skip
    own = {"angle_deg": "deg", "frequency": "Hz", "phase": "rad", "plant_gain": "rad/(N m)", "plant_phase": "rad"}
    findings.table("data/response.csv", pd.concat(curves), own, {"gain": "of the loop's transfer"})
    steps = [
        pd.DataFrame({"angle_deg": angle, "time": each.step.time, "response": each.step.angle})
        for angle, each in zip(angles, found, strict=True)
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
            pd.DataFrame({"course": k, "time": each.time, "error": each.error, "rate": each.rate, "sigma": each.sigma})
            for k, each in enumerate(portrait.courses)
        ]
        seen = {"time": "s", "error": "rad", "rate": "rad/s"}
        findings.table("data/portrait.csv", pd.concat(courses), seen, {"sigma": "0 on the sliding surface"})


def draw(
    findings: Findings, label: str, angles: Sequence[float], found: Sequence[LoopAnalysis], locus: RootLocus | None,
    portrait: PhasePortrait | None,
) -> None:  # fmt: skip
    """The Bode plot first; of a loop that feeds nothing back, that of the plant."""
    from wristctl.commands.analyse import figures

    heading = f"{label}: the plant, angle per torque" if locus is None else f"{label}: loop transfer"
    findings.figure("bode", figures.bode, found, angles, heading)
    if any(each.margins.stable for each in found):
        findings.figure("step", figures.step, found, angles)
    if locus is not None:
        findings.figure("sensitivity", figures.sensitivity, found, angles)
        findings.figure("locus", figures.locus, locus)
    if portrait is not None:
        findings.figure("portrait", figures.portrait, portrait)
