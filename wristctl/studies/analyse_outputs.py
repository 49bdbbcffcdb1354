"""What an analysis leaves: its numbers, tables of what was drawn, and the figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from wristctl.studies.findings import Findings

if TYPE_CHECKING:
    from wristctl.stability.loop_analysis import LoopAnalysis
    from wristctl.stability.phase_portrait import PhasePortrait
    from wristctl.stability.root_locus import RootLocus

_HZ = 1.0 / (2.0 * math.pi)
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
    from wristctl.report import stability_figures as figures

    heading = f"{label}: the plant, angle per torque" if locus is None else f"{label}: loop transfer"
    findings.figure("bode", figures.bode, found, angles, heading)
    if any(each.margins.stable for each in found):
        findings.figure("step", figures.step, found, angles)
    if locus is not None:
        findings.figure("sensitivity", figures.sensitivity, found, angles)
        findings.figure("locus", figures.locus, locus)
    if portrait is not None:
        findings.figure("portrait", figures.portrait, portrait)
