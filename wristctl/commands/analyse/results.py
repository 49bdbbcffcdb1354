"""Results of the analysis of a loop as tables, files and figures: each quantity with its unit in one place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from wristctl.commands.printed_table import Table, number
from wristctl.commands.quantities import Quantity, documented, table_of
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.stability.loop_analysis import LoopAnalysis, RootLocus
    from wristctl.stability.phase_portrait import PhasePortrait

_HZ = 1.0 / (2.0 * math.pi)
# Place at which the loop is cut, by the sensor's level: the same loop on both sides of motors and wrist.
CUTS = {
    "ideal": "the law's torque (ideal sensing)",
    "camera": "the camera's frames",
}
_EACH = "factor of one plane's gain {} to which it is stable, whatever the other's up to its own"
_QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("angle_deg", "deg", "where the loop rests, toward the direction", "at rest"),
        Quantity("torque", "N m", "that holds it there"),
        Quantity("stable", "", "whether small swings die out"),
        Quantity("growth", "1/s", "of the least stable mode"),
        Quantity("gain_margin", "dB"),
        Quantity("gain_most", "", "factor of the loop's gain up to which it is stable"),
        Quantity("gain_most_frequency", "Hz", "with which it begins to oscillate there", "at"),
        Quantity("gain_least", "", "factor of the loop's gain down to which it is stable", "least factor"),
        Quantity("gain_least_frequency", "Hz", "with which it begins to oscillate there", "least factor at"),
        Quantity("phase_margin", "rad", "smallest where the loop gain is 1"),
        Quantity("delay_margin", "s", "least delay more that makes it unstable", shown="ms"),
        Quantity("delay_frequency", "Hz", "with which it begins to oscillate then", "then at"),
        Quantity("sensitivity", "", "Ms, largest |1/(1 + L)|", "Ms"),
        Quantity("complementary", "", "Mt, largest |L/(1 + L)|", "Mt"),
        Quantity("rise", "s", "of a small step from 10 to 90 %", "rise 10-90 %", "ms"),
        Quantity("overshoot", "", "of a small step, as a share of where it ends", shown="%"),
        Quantity("settling", "s", "of a small step to 2 %", shown="ms"),
        Quantity("final", "", "share of a small step at which the angle arrives", "arrives at", "%"),
        Quantity("toward_deg", "deg", "direction of the resting bend, from ulnar toward flexion"),
        Quantity("each_least", "", _EACH.format("down"), "least factor"),
        Quantity("each_most", "", _EACH.format("up"), "largest factor"),
        Quantity("each_phase", "rad", "phase that each plane bears by itself", "phase"),
    )
}  # fmt: skip


def picked(*names: str) -> list[Quantity]:
    """Quantities of a resting loop by name."""
    return [_QUANTITIES[name] for name in names]


def decibels(factor: float) -> float:
    """A factor of the gain in dB; -inf for 0."""
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def _record(angle: float, analysis: LoopAnalysis, toward_deg: float | None) -> dict[str, Any]:
    """Margins and step at one resting angle [deg]; inf where there is no limit."""
    margins, step, torque = analysis.margins, analysis.step, analysis.linear.torque
    record = {
        "angle_deg": angle, "torque": torque if analysis.linear.planes == 1 else math.hypot(*torque),
        "stable": margins.stable, "growth": margins.growth, "gain_margin": decibels(margins.most.value),
        "gain_most": margins.most.value, "gain_most_frequency": _HZ * margins.most.omega,
        "gain_least": margins.least.value, "gain_least_frequency": _HZ * margins.least.omega,
        "phase_margin": margins.phase.value, "delay_margin": margins.delay,
        "delay_frequency": _HZ * margins.delay_omega, "sensitivity": margins.sensitivity.value,
        "complementary": margins.complementary.value, "rise": step.rise, "overshoot": step.overshoot,
        "settling": step.settling, "final": step.final,
    }  # fmt: skip
    if toward_deg is None:
        return record
    each = margins.of_each
    return record | {
        "toward_deg": toward_deg, "each_least": each.least, "each_most": each.most, "each_phase": each.phase,
    }  # fmt: skip


def tables_of_margins(records: Sequence[dict[str, Any]]) -> list[Table]:
    """Margins, in two planes what each bears by itself, and the response to a small step, a row per resting angle."""
    margins = (
        "angle_deg", "torque", "stable", "gain_margin", "gain_most_frequency", "gain_least", "gain_least_frequency",
        "phase_margin", "delay_margin", "delay_frequency", "sensitivity", "complementary",
    )  # fmt: skip
    each = [record if record["stable"] else {"angle_deg": record["angle_deg"]} for record in records]
    by_itself = picked("angle_deg", "each_least", "each_most", "each_phase")
    step = picked("angle_deg", "rise", "overshoot", "settling", "final")
    return [
        table_of("Margins", picked(*margins), records),
        *[table_of("What each plane bears by itself, by the largest sensitivity", by_itself, each)]
        * ("each_least" in records[0]),
        table_of("A small step of the reference", step, records),
    ]


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

    def records(self) -> list[dict[str, Any]]:
        """Margins and step at each resting angle, by the quantities' names."""
        return [_record(*row, self.toward_deg) for row in zip(self.angles, self.analyses, strict=True)]

    def frame(self) -> pd.DataFrame:
        """Margins and step, a row per resting angle [deg]; SI units, phase margins in rad, inf: no limit."""
        import pandas as pd

        return pd.DataFrame(self.records()).drop(columns="gain_margin")


def write(findings: Findings, results: LoopResults) -> None:
    """Write the worst margins of all resting angles as metrics, and all results as tables."""
    import numpy as np
    import pandas as pd

    angles, analyses, locus, portrait, toward_deg = results
    rows = results.frame()
    worst: dict[str, tuple[Literal["lower", "higher"], float]] = {
        "gain_most": ("higher", rows["gain_most"].min()), "gain_least": ("lower", rows["gain_least"].max()),
        "delay_margin": ("higher", rows["delay_margin"].min()), "sensitivity": ("lower", rows["sensitivity"].max()),
        "complementary": ("lower", rows["complementary"].max()), "overshoot": ("lower", rows["overshoot"].max()),
        "settling": ("lower", rows["settling"].max()), "growth": ("lower", rows["growth"].max()),
    }  # fmt: skip
    for name, (better, value) in worst.items():
        (quantity,) = picked(name)
        shown = float(value) if all(analysis.margins.stable for analysis in analyses) or name == "growth" else math.nan
        description = f"{quantity.meaning}; the worst of all resting angles"
        findings.metric(
            name, shown if math.isfinite(shown) else None, quantity.unit, better, len(analyses), meaning=description
        )
    findings.table("data/margins.csv", rows, *documented(picked(*rows)))
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
