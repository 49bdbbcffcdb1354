"""Numbers of a run's page: its tables, a comparison's in one, and angles in degrees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from wristctl.errors import Call, UserError
from wristctl.reader_units import in_degrees, metric_in_words, readable
from wristctl.records.manifest import TABLES
from wristctl.records.run import Run
from wristctl.study_files.keys import command_of

_WHO = ("loop", "reference", "controller", "gains", "inverse")


def tables(run: Run) -> list[dict[str, Any]]:
    """The tables that a command printed or kept: title, columns and rows each."""
    stored = run.json(TABLES) if run.has(TABLES) else []
    if not isinstance(stored, list) or not all(map(_is_table, stored)):
        again = ("restore it, or run `", Call(command_of(run.kind)), "` again")
        raise UserError("no tables as wristctl writes them", str(run.path / TABLES), again)
    return stored


def shown_tables(run: Run) -> list[dict[str, Any]]:
    """The tables for a page: angles in degrees, and those of a comparison's loops and motions in one."""
    stored = tables(run)
    if run.kind == "compare" and run.has("data/comparison.csv"):
        stored = _in_one(run, stored)
    shown = []
    for table in stored:
        heads, rows = readable(table["columns"], table["rows"])
        shown.append(table | {"columns": heads, "rows": rows})
    return shown


def _is_table(stored: object) -> bool:
    """Whether a page can show it: a title, names of columns and rows of cells."""
    if not isinstance(stored, dict) or not isinstance(stored.get("title"), str):
        return False
    columns, rows = stored.get("columns"), stored.get("rows")
    if not isinstance(columns, list) or not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        return False
    return not any(isinstance(cell, list | dict) for row in (columns, *rows) for cell in row)


def _in_one(run: Run, stored: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The tables of a comparison, with one in place of those of each loop and motion: a row per row of its file."""
    from wristctl.simulation.metrics import METRICS

    frame = run.data("comparison")
    titles = {
        f"Loop {loop}, {motion}": (loop, motion) for loop, motion in zip(frame.loop, frame.reference, strict=True)
    }
    of_loops, others, verdicts = list[str](), list[dict[str, Any]](), dict[tuple[str, ...], str]()
    for table in stored:
        motion = titles.get(table["title"]) or titles.get(table["title"].rpartition(", medians of ")[0])
        if motion is None:
            others.append(table)
            continue
        of_loops.append(table["title"])
        verdicts |= {(*motion, *map(str, row[:2])): str(row[-1]) for row in table["rows"] if len(row) > 2}
    if not of_loops:
        return list(stored)
    shown = [name for name in frame.columns if name in METRICS and METRICS[name].heading and frame[name].notna().any()]
    units = {name: in_degrees(None, METRICS[name].unit)[1] for name in shown}
    heads = [metric_in_words(name) + f" [{unit}]" * (unit not in ("", "1")) for name, unit in units.items()]
    many = frame["inverse"].nunique() > 1
    columns = ["loop", "motion", "controller", *["inverse"] * many, *heads, "verdict"]
    rows = []
    for entry in frame.astype(dict.fromkeys(_WHO, str)).to_dict("records"):
        loop, reference, controller, gains, inverse = (entry[name] for name in _WHO)
        label = f"{controller}/{gains}"
        values = [in_degrees(float(entry[name]), METRICS[name].unit)[0] for name in shown]
        verdict = verdicts.get((loop, reference, label, inverse)) or ("failed" if entry["failed"] else "ok")
        rows.append([loop, reference, label, *[inverse] * many, *values, verdict])
    return [{"title": "", "columns": columns, "rows": rows}, *others]
