"""`wristctl runs rm`."""

from __future__ import annotations

from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Refs
from wristctl.config.errors import UserError
from wristctl.records import open_run
from wristctl.records.remove import removable, remove


def rm(
    refs: Refs,
    out: Out = RESULTS,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Even where other runs were made from it.")] = False,
    debug: Debug = False,
) -> None:
    """Delete runs, after asking. Refuses to delete one that others were made from, unless --force."""
    runs = removable([open_run(ref, out) for ref in refs], force)
    for run in runs:
        print(run.path)
    if not yes and not typer.confirm(f"Delete {len(runs)} run{'s' * (len(runs) > 1)}?", err=True):
        raise UserError("nothing was deleted", ", ".join(refs), "answer y, or give --yes")
    for run in runs:
        remove(run)
