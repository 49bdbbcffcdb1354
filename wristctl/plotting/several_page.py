"""The page of several runs beside each other."""

from __future__ import annotations

from typing import Any

from wristctl.plotting.page import Figures, figures, render
from wristctl.records.difference import difference
from wristctl.records.run import Run

_TITLES = {
    "config": "Configuration",
    "metrics": "Metrics",
    "code": "Code",
    "environment": "Environment",
    "inputs": "Inputs",
}


def several_page(runs: list[Run]) -> str:
    """The page of several runs, each of them against the first."""
    rows = [(run.id, run.kind, run.state, run.manifest.timing.started[:19], run.manifest.timing.wall_s) for run in runs]
    return render(
        "several.html",
        heading=" | ".join(run.manifest.label or run.id for run in runs),
        runs=runs,
        rows=rows,
        differences=_differences(runs),
        pictures=_pictures(runs),
    )


def _differences(runs: list[Run]) -> list[dict[str, Any]]:
    """A table for each part that differs: a row per leaf or metric, a column per run."""
    first, *later_runs = runs
    differences = [vars(difference(first, later_run)) for later_run in later_runs]
    tables = []
    for part, title in _TITLES.items():
        names = list(dict.fromkeys(change.name for parts in differences for change in parts[part]))
        rows = []
        for name in names:
            changes = [next((change for change in parts[part] if change.name == name), None) for parts in differences]
            before = next(change.before for change in changes if change)
            values = [before, *(change.after if change else before for change in changes)]
            rows.append((name, *(value if part == "metrics" else str(value) for value in values)))
        if rows:
            tables.append({"title": title, "columns": ["what", *(run.id for run in runs)], "rows": rows})
    return tables


def _pictures(runs: list[Run]) -> list[tuple[str, Figures]]:
    """The figures by name, each with one picture per run that has it."""
    pictures: dict[str, Figures] = {}
    for run in runs:
        for _, caption, picture in figures(run):
            pictures.setdefault(caption, []).append((run.id, run.id, picture))
    return list(pictures.items())
