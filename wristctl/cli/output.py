"""Output of a command on stdout: its plan, or its tables and the run directory."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.cli.json_output import print_json
from wristctl.commands.adoption import with_places
from wristctl.commands.perform import plain_tables
from wristctl.commands.printed_table import Table
from wristctl.config.study import Study
from wristctl.errors import Argument, UserError, reason_of
from wristctl.escape import printable
from wristctl.records import Run
from wristctl.study_files.resolved import changed_yaml, resolved_yaml

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def print_plan(kind: str, study: Study, plan: str, out: Path, as_json: bool, everything: bool = False) -> None:
    """Settings that are not at their defaults, or every one, with unit and source; and what would be done."""
    placed = with_places(study)
    resolved = resolved_yaml(placed, kind) if everything or as_json else changed_yaml(placed, kind)
    if as_json:
        return print_json({"schema": "wristctl.plan/1", "kind": kind, "config": resolved, "plan": plan})
    print(resolved, end="")
    rest = [] if everything else ["every other setting is at its default: --dry-run --all shows them"]
    for line in [*rest, *plan.splitlines(), f"would write a run of {kind} under {out}; nothing is written now"]:
        print(f"# {printable(line)}")


def print_result(
    path: Path,
    tables: Sequence[Table],
    as_json: bool,
    answer: Sequence[str] = (),
    everything: bool = False,
    fault: UserError | None = None,
) -> None:
    """The answer, or where there is none or `everything` is asked for the tables as wide as the terminal; then the run.

    Or all of the result as one JSON object. A result with a fault is printed, and the fault raised.
    """
    if as_json:
        run = Run(path)
        result = {
            "schema": "wristctl.result/1",
            "kind": run.kind,
            "id": run.id,
            "run": str(path),
            "state": run.state,
            "result_sha256": run.result_hash,
            "undrawn": run.manifest.undrawn,
            "answer": list(answer),
            "metrics": run.metrics,
            "tables": plain_tables(tables),
        }
        return print_json(result, fault)
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    if answer:
        print("\n".join(map(printable, answer)), end="\n\n")
    for table in tables if everything or not answer else ():
        print(table.text(width), end="\n\n")
    print(path)
    if fault is not None:
        raise fault


def print_table(table: Table, as_json: bool) -> None:
    """A table by itself, or as one JSON object."""
    if as_json:
        return print_json({"schema": "wristctl.list/1", "columns": table.columns, "rows": table.rows})
    print(table.text(_ALONE))


_ALONE = 100
"""Columns of a table that is printed by itself."""


def write_picture(file: Path, draw: Callable[[], Figure]) -> None:
    """Write a picture that was asked for beside what is printed, once it is. UserError where it cannot be drawn."""
    from wristctl.records.formats import own_look, write_figure_for_paper

    try:
        with own_look():
            picture = draw()
    except Exception as error:
        reason = f"the picture could not be drawn: {reason_of(error)}"
        raise UserError(reason, str(file), "--debug shows the traceback", exit_code=1) from error
    write_figure_for_paper(file, picture, by=Argument("figure"))


def say(text: object) -> None:
    """Print one line, whatever is in it."""
    print(printable(text))
