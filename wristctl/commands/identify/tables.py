"""Tables of an identification: parameters, fit, residuals, causes, what depends on what, what to add."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.identification.fit import Fit
from wristctl.identification.identifiability import Addition, width_text
from wristctl.identification.intervals import Knowledge, interval
from wristctl.identification.lack_of_fit import CAUSES, Misfit, Suspicion
from wristctl.identification.unknowns import UNKNOWNS

COLUMNS = ("parameter", "value", "low", "high", "unit", "believed", "verdict")


def parameter_rows(
    fitted: Fit, knowledge: Knowledge, lacking: Mapping[str, float]
) -> list[tuple[str, float, float, float, str, float, str]]:
    """Rows of parameters: value, ends of the interval, unit, believed value, verdict."""
    rows = []
    for name, value in fitted.values.items():
        held = name not in fitted.problem.free
        low, high = (value, value) if held else interval(fitted, knowledge, name)
        verdict = "fixed" if held else "not identified" if name in lacking else "identified"
        if verdict == "identified" and knowledge.assumed(fitted.problem.free.index(name)):
            verdict = "as assumed"
        rows.append((name, value, low, high, UNKNOWNS[name].unit, fitted.problem.start[name], verdict))
    return rows


def parameters(findings: Findings, fitted: Fit, knowledge: Knowledge, lacking: Mapping[str, float]) -> Table:
    """Parameters with their intervals, kept as a table and as metrics."""
    rows = parameter_rows(fitted, knowledge, lacking)
    for name, value, low, high, unit, _, verdict in rows:
        if verdict in ("identified", "as assumed"):
            findings.metric(name, value, unit, n=len(fitted.problem.trials), interval=(low, high))
    meaning = {"low": "of the 95 % interval", "high": "of the 95 % interval", "believed": "by the first run's study"}
    findings.table("data/parameters.csv", pd.DataFrame(rows, columns=COLUMNS), {}, meaning)
    return Table("Parameters with 95 % intervals", COLUMNS, rows)


def fit_table(findings: Findings, fitted: Fit, knowledge: Knowledge) -> Table:
    """Quality of the fit. Correlations and the small errors become files of the run."""
    frames = sum(map(len, fitted.residuals))
    rows = [
        ("condition", knowledge.condition, "", "condition number of the Jacobian, columns scaled to unit length"),
        ("residual", float(np.degrees(fitted.noise)), "deg", "standard deviation of marker less model"),
        ("autocorrelation", knowledge.autocorrelation, "", "of neighbouring residuals"),
        ("frames", float(frames), "", "frames used"),
        ("independent_frames", knowledge.effective, "", "independent frames that would tell as much"),
        ("evaluations", float(fitted.evaluations), "", "evaluations of the model and its Jacobian"),
    ]
    for name, value, unit, meaning in rows:
        findings.metric(name, value if np.isfinite(value) else None, unit, n=frames, meaning=meaning)
    names = list(fitted.problem.free)
    size = len(names)
    matrix = pd.DataFrame(knowledge.correlation[:size, :size], columns=names)
    matrix.insert(0, "parameter", names)
    findings.table("data/correlation.csv", matrix)
    errors = fitted.x[size:], knowledge.half_widths[size:]
    small = pd.DataFrame(
        {"error": list(fitted.problem.coordinates)[size:], "value": errors[0], "half_width": errors[1]}
    )
    unit = "rad (zero, turn), m (spool), s (clock), 1 (gain)"
    findings.table("data/zeros.csv", small, {"value": unit, "half_width": unit})
    return Table("Fit", ("", "value", "unit", "meaning"), rows)


def budget_table(fitted: Fit, moved: Mapping[str, Mapping[str, float]]) -> Table:
    """Shift of each parameter if an assumption of the model were wrong."""

    def cell(name: str, shift: float) -> str:
        if UNKNOWNS[name].log:
            return f"{100.0 * shift:+.2f} %"
        return f"{1e3 * shift:+.3f} ms" if UNKNOWNS[name].unit == "s" else f"{shift:+.4f}"

    names = fitted.problem.free
    rows = [(assumption, *(cell(name, shifts[name]) for name in names)) for assumption, shifts in moved.items()]
    return Table("What would move the result, if believed and not so", ("believed", *names), rows)


def offers(offered: list[Addition]) -> Table:
    """Widths of the intervals after each proposed addition."""
    names = list(offered[0].half_widths)
    rows = [
        (
            addition.what,
            *(width_text(name, addition.half_widths[name]) for name in names),
            "yes" if addition.enough else "no",
        )
        for addition in offered
    ]
    return Table("What to add, and half the interval that it would leave", ("added", *names, "enough"), rows)


def residual_table(misfits: Sequence[Misfit]) -> Table:
    """Residuals of every direction against the frames' own noise."""
    rows = [
        (misfit.direction, misfit.frames, *np.degrees([misfit.residual, misfit.noise]), misfit.ratio)
        for misfit in misfits
    ]
    heads = ("direction", "frames", "residual [deg]", "frames' noise [deg]", "chi-square / dof")
    return Table("What is left over", heads, rows)


def causes(fit: Fit, knowledge: Knowledge, suspected: Sequence[Suspicion]) -> Table:
    """Size of each cause in the residuals, and the shift of the worst parameter as a share of its interval."""
    half = dict(zip(fit.problem.free, knowledge.half_widths, strict=False))
    rows = []
    for suspicion in suspected:
        worst = max(half, key=lambda name: abs(suspicion.shifts[name]) / half[name])
        moved = f"{worst} by {suspicion.shifts[worst] / half[worst]:+.2f} of half its interval"
        size = f"{suspicion.size:.2g} +- {1.96 * suspicion.deviation:.2g} {CAUSES[suspicion.cause].unit}"
        rows.append((suspicion.cause, size, "evident" if suspicion.evident else "chance", moved))
    return Table("What the model may lack", ("cause", "size", "verdict", "would move"), rows)
