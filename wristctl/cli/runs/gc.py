"""`wristctl runs gc`."""

from __future__ import annotations

from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.records.leftovers import clear, clear_tags, leftovers, lost_repetitions, lost_tags


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
