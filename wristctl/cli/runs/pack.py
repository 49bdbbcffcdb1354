"""`wristctl runs pack` and `unpack`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run


def pack(
    ref: Ref,
    file: Annotated[
        Path | None, typer.Option("--file", help="Where to write it; by default the run's id, in this folder.")
    ] = None,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Put a run, and all that it was made from, into one archive for somebody else."""
    from wristctl.records.archive import pack as write

    run = open_run(ref, out)
    path = file or Path(f"{run.id}.zip")
    for each in write(run, path):
        say(each.id)
    say(path)


def unpack(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What `wristctl runs pack` wrote.")],
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Take the runs out of an archive, after checking that they are as they were sealed. Nothing in them is run.

    All arrive or none (exit code 3). A run that is here already is checked, and given the archive's signature where it
    has none. That files are as sealed does not say by whom: `wristctl runs verify --signers`.
    """
    from wristctl.records.archive import unpack as read

    found = read(file, out)
    for each in found.known:
        say(f"{each.id}  was here" + ", and has its signature now" * (each in found.signed))
    for each in found.new:
        say(f"{each.id}  as sealed")
    say(found.run.path)
