"""`wristctl runs table`."""

from __future__ import annotations

from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.config.errors import UserError
from wristctl.records import open_run


def table(
    ref: Ref,
    number: Annotated[
        list[int] | None, typer.Option("--table", "-n", help="Which of its tables, from 1; repeatable. All where none.")
    ] = None,
    latex: Annotated[bool, typer.Option("--latex", help="As LaTeX, for booktabs.")] = False,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Print the tables of a run: all that the command printed or kept back."""
    from wristctl.report.latex import latex_table
    from wristctl.report.page import tables
    from wristctl.report.printed_table import Table

    run = open_run(ref, out)
    found = [Table(each["title"], each["columns"], each["rows"]) for each in tables(run)]
    if not found:
        raise UserError(f"run {run.id} has no tables", str(run.path), "its data are in data/")
    for each in number or ():
        if not 1 <= each <= len(found):
            raise UserError(f"no table {each}", str(run.path), f"1 to {len(found)}")
    chosen = [found[each - 1] for each in number] if number else found
    print("\n\n".join(latex_table(each) if latex else each.text() for each in chosen))
