"""`wristctl runs tag`."""

from __future__ import annotations

from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run
from wristctl.records.tags import change_tags


def tag(
    ref: Ref,
    tags: Annotated[list[str] | None, typer.Argument(metavar="[TAG...]", help="Tags to add.")] = None,
    remove: Annotated[list[str] | None, typer.Option("--remove", help="A tag to take away; repeatable.")] = None,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Add tags to a run, or take them away; they stand in tags.json beside the runs."""
    run = open_run(ref, out)
    say(f"{run.id}  {', '.join(change_tags(run.path.parent, run.id, tags or (), remove or ())) or 'no tags'}")
