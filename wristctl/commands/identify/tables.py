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
    found: Fit, known: Knowledge, lacking: Mapping[str, float]
) -> list[tuple[str, float, float, float, str, float, str]]:
    """Each parameter: value, ends of its interval, unit, what was believed, verdict."""
    rows = []
    for name, value in found.values.items():
        held = name not in found.problem.free
        low, high = (value, value) if held else interval(found, known, name)
        verdict = "fixed" if held else "not identified" if name in lacking else "identified"
        if verdict == "identified" and known.assumed(found.problem.free.index(name)):
            verdict = "as assumed"
        rows.append((name, value, low, high, UNKNOWNS[name].unit, found.problem.start[name], verdict))
    return rows


def parameters(findings: Findings, found: Fit, known: Knowledge, lacking: Mapping[str, float]) -> Table:
    """Parameters with their intervals, kept as a table and as metrics."""
    rows = parameter_rows(found, known, lacking)
    for name, value, low, high, unit, _, verdict in rows:
        if verdict in ("identified", "as assumed"):
            findings.metric(name, value, unit, n=len(found.problem.trials), interval=(low, high))
    meaning = {"low": "of the 95 % interval", "high": "of the 95 % interval", "believed": "by the first run's study"}
    findings.table("data/parameters.csv", pd.DataFrame(rows, columns=COLUMNS), {}, meaning)
    return Table("Parameters with 95 % intervals", COLUMNS, rows)


def fit_table(findings: Findings, found: Fit, known: Knowledge) -> Table:
    """How good the fit is; correlations and the small errors are kept beside it."""
    frames = sum(map(len, found.residuals))
    rows = [
        ("condition", known.condition, "", "condition number of the Jacobian, columns scaled to unit length"),
        ("residual", float(np.degrees(found.noise)), "deg", "standard deviation of marker less model"),
        ("autocorrelation", known.autocorrelation, "", "of neighbouring residuals"),
        ("frames", float(frames), "", "frames used"),
        ("independent_frames", known.effective, "", "independent frames that would tell as much"),
        ("evaluations", float(found.evaluations), "", "evaluations of the model and its Jacobian"),
    ]
    for name, value, unit, meaning in rows:
        findings.metric(name, value if np.isfinite(value) else None, unit, n=frames, meaning=meaning)
    names = list(found.problem.free)
    size = len(names)
    matrix = pd.DataFrame(known.correlation[:size, :size], columns=names)
    matrix.insert(0, "parameter", names)
    findings.table("data/correlation.csv", matrix)
    errors = found.x[size:], known.half_widths[size:]
    small = pd.DataFrame({"error": list(found.problem.coordinates)[size:], "value": errors[0], "half_width": errors[1]})
    units = {"value": "rad (zero), m (spool)", "half_width": "rad (zero), m (spool)"}
    findings.table("data/zeros.csv", small, units)
    return Table("Fit", ("", "value", "unit", "meaning"), rows)


def budget_table(found: Fit, moved: Mapping[str, Mapping[str, float]]) -> Table:
    """By how much each parameter would move if something believed were not so."""

    def cell(name: str, shift: float) -> str:
        if UNKNOWNS[name].log:
            return f"{100.0 * shift:+.2f} %"
        return f"{1e3 * shift:+.3f} ms" if UNKNOWNS[name].unit == "s" else f"{shift:+.4f}"

    names = found.problem.free
    rows = [(what, *(cell(name, shifts[name]) for name in names)) for what, shifts in moved.items()]
    return Table("What would move the result, if believed and not so", ("believed", *names), rows)


def offers(offered: list[Addition]) -> Table:
    """What each addition would leave of the intervals."""
    names = list(offered[0].half_widths)
    rows = [
        (each.what, *(width_text(name, each.half_widths[name]) for name in names), "yes" if each.enough else "no")
        for each in offered
    ]
    return Table("What to add, and half the interval that it would leave", ("added", *names, "enough"), rows)


def residual_table(found: Sequence[Misfit]) -> Table:
    """Residuals of every direction against the frames' own noise."""
    rows = [(each.direction, each.frames, *np.degrees([each.residual, each.noise]), each.ratio) for each in found]
    heads = ("direction", "frames", "residual [deg]", "frames' noise [deg]", "chi-square / dof")
    return Table("What is left over", heads, rows)


def causes(fit: Fit, known: Knowledge, suspected: Sequence[Suspicion]) -> Table:
    """How much of each cause the residuals show, and by how much of its interval the worst parameter would move."""
    half = dict(zip(fit.problem.free, known.half_widths, strict=False))
    rows = []
    for each in suspected:
        worst = max(half, key=lambda name: abs(each.shifts[name]) / half[name])
        moved = f"{worst} by {each.shifts[worst] / half[worst]:+.2f} of half its interval"
        size = f"{each.size:.2g} +- {1.96 * each.deviation:.2g} {CAUSES[each.cause].unit}"
        rows.append((each.cause, size, "evident" if each.evident else "chance", moved))
    return Table("What the model may lack", ("cause", "size", "verdict", "would move"), rows)
