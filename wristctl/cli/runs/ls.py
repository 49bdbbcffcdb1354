"""`wristctl runs ls`."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated, Any

import typer

from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS
from wristctl.cli.say import say
from wristctl.records.index import IndexEntry
from wristctl.records.journal import jsonable
from wristctl.records.query import entries, in_order, select
from wristctl.report.printed_table import Table


def ls(
    out: Out = RESULTS,
    kind: Annotated[str | None, typer.Option("--kind", help="Only runs of this command.")] = None,
    label: Annotated[str | None, typer.Option("--label", help="Only runs with this label; * stands for any.")] = None,
    state: Annotated[str | None, typer.Option("--state", help="Only runs in this state: ok, failed, ...")] = None,
    tagged: Annotated[str | None, typer.Option("--tag", help="Only runs with this tag.")] = None,
    where: Annotated[
        list[str] | None, typer.Option("--where", help="Only runs with such a metric: 'rmse<1e-3'; repeatable.")
    ] = None,
    newer: Annotated[str | None, typer.Option("--newer", help="Only runs started within: 30m, 12h, 2d.")] = None,
    older: Annotated[str | None, typer.Option("--older", help="Only runs started before: 30m, 12h, 2d.")] = None,
    sort: Annotated[
        str, typer.Option("--sort", help="By started, id, kind, label, state, wall_s or a metric.")
    ] = "started",
    reverse: Annotated[bool, typer.Option("--reverse", help="Largest or newest first.")] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List runs, oldest first."""
    where = where or []
    found = in_order(select(entries(out), kind, label, state, tagged, where, newer, older), sort)
    found = found[::-1] if reverse else found
    if as_json:
        print(json.dumps(jsonable({"schema": "wristctl.runs/1", "runs": list(map(asdict, found))}), indent=2))
    elif found:
        print(_table(found, [sort, *where]).text())
    else:
        say(f"no runs in {out}" + " that meet this" * any((kind, label, state, tagged, where, newer, older)))


def _table(found: list[IndexEntry], asked: list[str]) -> Table:
    """The listing, with the metrics that were asked for and the columns that hold something."""
    metrics = sorted({name for each in found for name in each.metrics if any(text.startswith(name) for text in asked)})
    columns = ["id", "kind", "state", "wall_s", *metrics]
    columns += [name for name in ("tags", "note") if any(getattr(each, name) for each in found)]
    heads = ["wall [s]" if name == "wall_s" else name for name in columns]
    return Table("", heads, [[_cell(each.value(name)) for name in columns] for each in found])


def _cell(value: Any) -> Any:
    return ", ".join(value) if isinstance(value, list) else value
