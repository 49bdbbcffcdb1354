"""Results of the analysis of a loop as tables, files and figures: each quantity with its unit in one place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from wristctl.commands.analyse.answer import answer_of, decibels, listed, picked
from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, number
from wristctl.commands.quantities import documented, table_of
from wristctl.commands.results import StudyResult
from wristctl.errors import UserError

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


@dataclass(frozen=True, repr=False, eq=False)
class Analysed(StudyResult):
    """One loop about each of its resting angles [deg]."""

    kind = "analyse"

    label: str
    """Controller with its gains."""
    angles: Sequence[float]
    found: Sequence[LoopAnalysis]
    """Analysis at each resting angle."""
    locus: RootLocus | None
    """Root locus at the last angle; None where nothing is fed back."""
    portrait: PhasePortrait | None
    """Phase portrait of a sliding law, toward the last angle; None of another law."""
    toward_deg: float | None = None
    """Direction of the resting bends from ulnar toward flexion [deg]; None in one plane."""

    @property
    def answer(self) -> Answer:
        """Whether the loop is stable, with its least margins."""
        return answer_of(self.label, self.records(), self.found, self.place)

    @property
    def marks(self) -> list[str]:
        """The angles at which the loop is unstable."""
        bad = self._unstable_at
        return [f"unstable at {listed(bad)}"] * bool(bad)

    @property
    def _unstable_at(self) -> list[float]:
        return [angle for angle, analysis in zip(self.angles, self.found, strict=True) if not analysis.margins.stable]

    @property
    def fault(self) -> UserError | None:
        """Error that names the angles at which the loop is unstable; None where it is stable."""
        bad = self._unstable_at
        if not bad:
            return None
        fix = "look at the figures; try other gains, or a shorter control_period"
        return UserError(f"the loop is unstable at {listed(bad)}", self.place, fix, exit_code=3)

    def records(self) -> list[dict[str, Any]]:
        """Margins and step at each resting angle, by the quantities' names."""
        return [_record(*row, self.toward_deg) for row in zip(self.angles, self.found, strict=True)]

    def frame(self) -> pd.DataFrame:
        """Margins and step, a row per resting angle [deg]; SI units, phase margins in rad, inf: no limit."""
        import pandas as pd

        return pd.DataFrame(self.records()).drop(columns="gain_margin")


def write(result: Analysed) -> None:
    """Write the worst margins of all resting angles as metrics, and all results as tables."""
    import numpy as np
    import pandas as pd

    findings, angles, analyses, toward_deg = result.findings, result.angles, result.found, result.toward_deg
    locus, portrait, rows = result.locus, result.portrait, result.frame()
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
    of_plane = {} if toward_deg is None else {"locus": "number of the eigenvalue"}
    curves = [
        {
            "angle_deg": angle, **dict.fromkeys(of_plane, number),
            "frequency": _HZ * analysis.omega, "gain": np.abs(curve), "phase": np.unwrap(np.angle(curve)),
            "plant_gain": np.abs(plant), "plant_phase": np.unwrap(np.angle(plant)),
        }
        for angle, analysis in zip(angles, analyses, strict=True)
        for number, (curve, plant) in enumerate(zip(analysis.loci, analysis.plant_loci, strict=True), 1)
    ]  # fmt: skip
    steps = [
        {"angle_deg": angle, "time": analysis.step.time, "response": analysis.step.angle}
        for angle, analysis in zip(angles, analyses, strict=True)
    ]
    poles = [] if locus is None else [
        {"factor": factor, "growth": each[:, 0], "frequency": each[:, 1]}
        for factor, each in zip(locus.factors, locus.poles, strict=True)
    ]  # fmt: skip
    courses = [] if portrait is None else [
        {"course": k, "time": course.time, "error": course.error, "rate": course.rate, "sigma": course.sigma}
        for k, course in enumerate(portrait.courses)
    ]  # fmt: skip
    transfer = f"of {'an eigenvalue of ' * bool(of_plane)}the loop's transfer"
    units = {"angle_deg": "deg", "frequency": "Hz", "phase": "rad", "plant_gain": "rad/(N m)", "plant_phase": "rad"}
    files: list[tuple[str, list[dict[str, Any]], dict[str, str], dict[str, str]]] = [
        ("response", curves, units, {"gain": transfer, **of_plane}),
        ("step", steps, {"angle_deg": "deg", "time": "s"}, {"response": "angle per step"}),
        ("locus", poles, {"growth": "1/s", "frequency": "Hz"}, {"factor": locus.over if locus else ""}),
        ("portrait", courses, {"time": "s", "error": "rad", "rate": "rad/s"}, {"sigma": "0 on the sliding surface"}),
    ]
    for name, parts, of_columns, meaning in files:
        if parts:
            findings.table(f"data/{name}.csv", pd.concat(map(pd.DataFrame, parts)), of_columns, meaning)


def draw(result: Analysed) -> None:
    """Draw the Bode plot first; of a loop that feeds nothing back, the plant's."""
    from wristctl.commands.analyse import figures

    findings, angles, analyses, locus = result.findings, result.angles, result.found, result.locus
    heading = f"{result.label}: the plant, angle per torque" if locus is None else f"{result.label}: loop transfer"
    findings.figure("bode", figures.bode, analyses, angles, heading)
    if any(analysis.margins.stable for analysis in analyses):
        findings.figure("step", figures.step, analyses, angles)
    if locus is not None:
        findings.figure("sensitivity", figures.sensitivity, analyses, angles)
        findings.figure("locus", figures.locus, locus)
    if result.portrait is not None:
        findings.figure("portrait", figures.portrait, result.portrait)
