"""`wristctl runs diff`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Annotated, Any

import typer

from wristctl.cli.completion import run_ids
from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run
from wristctl.records.difference import Difference, difference
from wristctl.records.journal import jsonable
from wristctl.report.printed_table import Table

_HEADS = {"config": "Configuration", "code": "Code", "environment": "Environment", "inputs": "Inputs"}


def diff(
    before: Ref,
    after: Annotated[str, typer.Argument(metavar="OTHER", help="The run to compare it with.", autocompletion=run_ids)],
    out: Out = RESULTS,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show what differs between two runs: configuration, metrics, code, environment, inputs."""
    a, b = open_run(before, out), open_run(after, out)
    found = difference(a, b)
    if as_json:
        changed = {
            name: {each.name: {"before": each.before, "after": each.after} for each in changes}
            for name, changes in vars(found).items()
        }
        print(json.dumps(jsonable({"schema": "wristctl.diff/1", "before": a.id, "after": b.id, **changed}), indent=2))
        return
    say(f"before  {a.id}")
    say(f"after   {b.id}")
    print()
    print("\n\n".join(table.text() for table in _tables(found)) or "nothing differs")


def _tables(found: Difference) -> Iterator[Table]:
    for name, title in _HEADS.items():
        if name == "code" and found.metrics:
            rows = [(each.name, each.before, each.after, *_change(each.before, each.after)) for each in found.metrics]
            yield Table("Metrics", ("metric", "before", "after", "change", "change [%]"), rows)
        if changes := getattr(found, name):
            changed = [(each.name, _text(each.before), _text(each.after)) for each in changes]
            yield Table(title, ("what", "before", "after"), changed)


def _change(before: Any, after: Any) -> tuple[float | None, float | None]:
    if not isinstance(before, int | float) or not isinstance(after, int | float):
        return None, None
    return after - before, 100.0 * (after - before) / abs(before) if before else None


def _text(value: Any) -> str:
    return "-" if value is None else str(value)
