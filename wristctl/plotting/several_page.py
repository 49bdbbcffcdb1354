"""The page of several runs beside each other: what differs, then each one's finding and figures."""

from __future__ import annotations

from string import ascii_uppercase
from typing import Any

from wristctl.plotting.page import Figures, figures, render
from wristctl.reader_units import in_degrees, metric_in_words
from wristctl.records.difference import difference
from wristctl.records.manifest import read_overview
from wristctl.records.run import Run

_TITLES = {"config": "Settings", "metrics": "Metrics"}
_FURTHER = {"inputs": "Inputs", "code": "Code", "environment": "Computer and packages"}


def several_page(runs: list[Run]) -> str:
    """The page of several runs, each of them against the first; the runs are called A, B and so on."""
    names = [ascii_uppercase[k] if k < len(ascii_uppercase) else str(k + 1) for k in range(len(runs))]
    overviews = [read_overview(run.path) for run in runs]
    shown = [
        {"name": name, "id": run.id, "kind": run.kind, "state": run.state, "answer": overview.sentence,
         "marks": ", ".join(overview.marks)}
        for name, run, overview in zip(names, runs, overviews, strict=True)
    ]  # fmt: skip
    timings = [run.manifest.timing for run in runs]
    rows = [
        (name, run.id, timing.started[:19].replace("T", " "), timing.wall_s)
        for name, run, timing in zip(names, runs, timings, strict=True)
    ]
    return render(
        "several.html",
        heading=" | ".join(run.manifest.label or run.id for run in runs),
        runs=shown,
        rows=rows,
        first=_differences(runs, names, _TITLES),
        further=_differences(runs, names, _FURTHER),
        pictures=_pictures(runs, names),
    )


def _differences(runs: list[Run], names: list[str], titles: dict[str, str]) -> list[dict[str, Any]]:
    """A table for each part that differs: a row per leaf or metric, a run's headline first, and a column per run."""
    first, *later_runs = runs
    differences = [vars(difference(first, later_run)) for later_run in later_runs]
    heading = dict.fromkeys(name for run in runs for name in read_overview(run.path).cards)
    tables = []
    for part, title in titles.items():
        changed = list(dict.fromkeys(change.name for parts in differences for change in parts[part]))
        changed.sort(key=lambda name: name not in heading)
        rows = []
        for name in changed:
            changes = [next((change for change in parts[part] if change.name == name), None) for parts in differences]
            before = next(change.before for change in changes if change)
            values = [before, *(change.after if change else before for change in changes)]
            rows.append(_metric(runs, name, values) if part == "metrics" else [name, *map(_text, values)])
        if rows:
            columns = ["metric", "unit", *names] if part == "metrics" else ["what", *names]
            tables.append({"title": title, "columns": columns, "rows": rows})
    return tables


def _metric(runs: list[Run], name: str, values: list[Any]) -> list[Any]:
    """The row of a metric, angles in degrees; its unit is that of the first run that has it."""
    unit = next((run.metrics[name].get("unit") or "" for run in runs if name in run.metrics), "")
    shown = in_degrees(None, unit)[1]
    return [metric_in_words(name, shown), shown, *(in_degrees(value, unit)[0] for value in values)]


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _pictures(runs: list[Run], names: list[str]) -> list[tuple[str, Figures]]:
    """The figures by caption, each with one picture per run that has it."""
    pictures: dict[str, Figures] = {}
    for name, run in zip(names, runs, strict=True):
        for _, caption, picture in figures(run):
            pictures.setdefault(caption, []).append((run.id, name, picture))
    return list(pictures.items())
