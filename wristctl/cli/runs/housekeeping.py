"""`wristctl runs rm`, `gc` and `pack`."""

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import RESULTS, Debug, Out, Ref, Refs
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


def gc(
    out: Out = RESULTS,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    debug: Debug = False,
) -> None:
    """Clear away what killed processes have left, after asking: no run that began is touched."""
    found, tags = [*leftovers(out), *lost_repetitions()], lost_tags(out)
    for each in found:
        say(f"{each.path}  {each.what}, {each.size / 1e6:.1f} MB")
    for run, names in tags.items():
        say(f"{out / 'tags.json'}  tags of {run}, which is gone: {', '.join(names)}")
    if not found and not tags:
        say(f"nothing is left over in {out}")
        return
    if not yes and not typer.confirm(f"Delete {len(found) + len(tags)} leftovers?", err=True):
        raise UserError("nothing was deleted", str(out), "answer y, or give --yes")
    still = {*leftovers(out), *lost_repetitions()}
    refused = []
    for each in found:
        if each in still:  # not meanwhile the beginning of a run
            try:
                clear(each)
            except PermissionError as error:  # another user's; the others can still go
                refused.append(error.filename or str(each.path))
    clear_tags(out, tags)
    if refused:
        what = f"{len(refused)} of {len(found)} leftovers are not yours to delete"
        raise UserError(what, refused[0], "ask their owner, or an administrator")


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
