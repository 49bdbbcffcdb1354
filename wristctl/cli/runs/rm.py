"""`wristctl runs rm`."""

from __future__ import annotations

from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Refs
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.records import open_run
from wristctl.records.remove import foreign, removable, remove


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
        others = foreign(run)
        say(f"{run.path}  (a link: what it leads to stays)" if run.path.is_symlink() else run.path)
        if others:
            say(f"  and in it, added by others: {', '.join(others)}")
    if not yes and not typer.confirm(f"Delete {len(runs)} run{'s' * (len(runs) > 1)}?", err=True):
        raise UserError("nothing was deleted", ", ".join(refs), "answer y, or give --yes")
    for run in removable(runs, force):  # asked again: an answer may take a while
        remove(run)
