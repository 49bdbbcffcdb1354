"""Delete runs, but none that others were made from."""

from __future__ import annotations

import shutil
from collections.abc import Sequence

from wristctl.config.errors import UserError
from wristctl.records.lineage import dependents
from wristctl.records.run import Run
from wristctl.records.tags import change_tags, read_tags


def removable(runs: Sequence[Run], force: bool = False) -> list[Run]:
    """The runs, each once; UserError for one that is running or, without `force`, that a run not among them read."""
    chosen = {run.id: run for run in runs}
    for run in chosen.values():
        if run.state == "running":
            raise UserError("run is still going on", str(run.path), "end it first")
        users = [name for name in dependents(run, run.path.parent) if name not in chosen]
        if users and not force:
            fix = "delete those too, or break the lineage with --force"
            raise UserError(f"{len(users)} runs were made from it: {', '.join(users[:3])}", run.id, fix)
    return list(chosen.values())


def remove(run: Run) -> None:
    """Delete a run and its tags. It is first renamed, so that no half-deleted run is ever listed."""
    hidden = run.path.with_name(f".{run.id}.removed")
    run.path.rename(hidden)
    shutil.rmtree(hidden)
    if tags := read_tags(run.path.parent).get(run.id):
        change_tags(run.path.parent, run.id, remove=tags)
