"""`wristctl runs ls`."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import asdict, fields
from typing import Annotated, Any, get_args

import typer

from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS
from wristctl.cli.say import say
from wristctl.config.errors import UserError, meant
from wristctl.config.wording import Argument
from wristctl.records.index import IndexEntry
from wristctl.records.journal import jsonable
from wristctl.records.query import entries, in_order, select
from wristctl.records.run import RunState
from wristctl.report.printed_table import Table, number

_HEADS = {"wall_s": "wall [s]", "chief": "chief metric"}


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
    columns: Annotated[
        str | None, typer.Option("--columns", help="Fields and metrics to show: id,about,rmse,settling.")
    ] = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List runs, oldest first: what each was about, and the metric that heads its page."""
    where = where or []
    known = entries(out)
    _check_choice("kind", kind, {each.kind for each in known})
    _check_choice("state", state, get_args(RunState))
    found = in_order(select(known, kind, label, state, tagged, where, newer, older), sort)
    found = found[::-1] if reverse else found
    if as_json:
        print(json.dumps(jsonable({"schema": "wristctl.runs/1", "runs": list(map(asdict, found))}), indent=2))
    elif found:
        print((_chosen(found, columns) if columns else _table(found, [sort, *where])).text())
    else:
        say(f"no runs in {out}" + " that meet this" * any((kind, label, state, tagged, where, newer, older)))


def _table(found: list[IndexEntry], asked: list[str]) -> Table:
    """The listing, with the metrics that were asked for and the columns that hold something."""
    metrics = sorted({name for each in found for name in each.metrics if any(text.startswith(name) for text in asked)})
    held = [name for name in ("about", "chief") if any(getattr(each, name) for each in found)]
    columns = ["id", "kind", "state", "wall_s", *held, *metrics]
    columns += [name for name in ("tags", "note") if any(getattr(each, name) for each in found)]
    heads = [_HEADS.get(name, name) for name in columns]
    return Table("", heads, [[_cell(each, name) for name in columns] for each in found])


def _chosen(found: list[IndexEntry], columns: str) -> Table:
    """The columns that were named."""
    names = [name.strip() for name in columns.split(",") if name.strip()]
    known = {*(field.name for field in fields(IndexEntry)), *(metric for each in found for metric in each.metrics)}
    for name in names:
        _check_choice("columns", name, known)
    return Table(
        "", [_HEADS.get(name, name) for name in names], [[_cell(each, name) for name in names] for each in found]
    )


def _check_choice(option: str, given: str | None, known: Collection[str]) -> None:
    if given is not None and known and "*" not in given and given not in known:
        raise UserError(f"unknown {option.removesuffix('s')} {given!r}", Argument(option, given), meant(given, known))


def _cell(each: IndexEntry, name: str) -> Any:
    if name == "chief":
        value = each.metrics.get(each.chief)
        return f"{each.chief} {number(value)}" if isinstance(value, int | float) else ""
    value = each.value(name)
    return ", ".join(value) if isinstance(value, list) else value
