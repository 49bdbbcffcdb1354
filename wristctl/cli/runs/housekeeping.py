"""`wristctl runs rm`, `gc` and `pack`."""

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import RESULTS, Out, Ref, Refs
from wristctl.cli.output import say
from wristctl.errors import UserError
from wristctl.records import open_run
from wristctl.records.removal import (
    clear,
    clear_tags,
    foreign,
    leftovers,
    lost_repetitions,
    lost_tags,
    removable,
    remove,
)


def rm(
    refs: Refs,
    out: Out = RESULTS,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Even where other runs were made from it.")] = False,
) -> None:
    """Delete runs, after asking. Refuses to delete one that others were made from, unless --force."""
    runs = removable([open_run(ref, out) for ref in refs], force)
    for run in runs:
        foreign_files = foreign(run)
        say(f"{run.path}  (a link: what it leads to stays)" if run.path.is_symlink() else run.path)
        if foreign_files:
            say(f"  and in it, added by others: {', '.join(foreign_files)}")
    if not yes and not typer.confirm(f"Delete {len(runs)} run{'s' * (len(runs) > 1)}?", err=True):
        raise UserError("nothing was deleted", ", ".join(refs), "answer y, or give --yes")
    for run in removable(runs, force):  # asked again: an answer may take a while
        remove(run)


def gc(
    out: Out = RESULTS,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
) -> None:
    """Clear away what killed processes have left, after asking: no run that began is touched."""
    leftover_files, tags = [*leftovers(out), *lost_repetitions()], lost_tags(out)
    for leftover in leftover_files:
        say(f"{leftover.path}  {leftover.what}, {leftover.size / 1e6:.1f} MB")
    for run, names in tags.items():
        say(f"{out / 'tags.json'}  tags of {run}, which is gone: {', '.join(names)}")
    if not leftover_files and not tags:
        say(f"nothing is left over in {out}")
        return
    if not yes and not typer.confirm(f"Delete {len(leftover_files) + len(tags)} leftovers?", err=True):
        raise UserError("nothing was deleted", str(out), "answer y, or give --yes")
    still = {*leftovers(out), *lost_repetitions()}
    refused = []
    for leftover in leftover_files:
        if leftover in still:  # not meanwhile the beginning of a run
            try:
                clear(leftover)
            except PermissionError as error:  # another user's; the others can still go
                refused.append(error.filename or str(leftover.path))
    clear_tags(out, tags)
    if refused:
        problem = f"{len(refused)} of {len(leftover_files)} leftovers are not yours to delete"
        raise UserError(problem, refused[0], "ask their owner, or an administrator")


def pack(
    ref: Ref,
    file: Annotated[
        Path | None, typer.Option("--file", help="Where to write it; by default the run's id, in this folder.")
    ] = None,
    out: Out = RESULTS,
) -> None:
    """Put a run, and all that it was made from, into one archive for somebody else."""
    from wristctl.records.archive import pack as write

    run = open_run(ref, out)
    path = file or Path(f"{run.id}.zip")
    for packed in write(run, path):
        say(packed.id)
    say(path)


def unpack(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What `wristctl runs pack` wrote.")],
    out: Out = RESULTS,
) -> None:
    """Take the runs out of an archive, after checking that they are as they were sealed. Nothing in them is run.

    All arrive or none (exit code 3). A run that is here already is checked, and given the archive's signature where it
    has none. That files are as sealed does not say by whom: `wristctl runs verify --signers`.
    """
    from wristctl.records.archive import unpack as read

    unpacked = read(file, out)
    for member in unpacked.known:
        say(f"{member.id}  was here" + ", and has its signature now" * (member in unpacked.signed))
    for member in unpacked.new:
        say(f"{member.id}  as sealed")
    say(unpacked.run.path)
