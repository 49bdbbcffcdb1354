"""Delete runs, but none that others were made from."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.sha256sums import read_seal
from wristctl.records.lineage import dependents
from wristctl.records.lock import delete_folder
from wristctl.records.run import Run
from wristctl.records.seal import added
from wristctl.records.tags import change_tags, known_tags

REMOVED = ".removed"
"""End of the hidden name under which a run is deleted."""


def removable(runs: Sequence[Run], force: bool = False) -> list[Run]:
    """The runs, each once; UserError for one that is gone, running or, without `force`, that a run not among them read.

    Ask again after the user has answered: meanwhile another may have begun to use it.
    """
    chosen = {run.path: run for run in runs}
    names = {run.id for run in chosen.values()}
    for run in chosen.values():
        if not run.path.is_dir():
            raise UserError("run is gone meanwhile", str(run.path), "there is nothing left to delete")
        if run.state == "running":
            raise UserError("run is still going on", str(run.path), "end it first")
        if alien := _held_by_others(run.path):
            raise UserError("you may not delete this run", str(alien), "ask its owner, or an administrator")
        users = [name for name in dependents(run, run.path.parent) if name not in names]
        if users and not force:
            fix = "delete those too, or break the lineage with --force"
            raise UserError(f"{len(users)} runs were made from it: {', '.join(users[:3])}", run.id, fix)
    return list(chosen.values())


def foreign(run: Run) -> list[str]:
    """Files in a run's folder that are not the run's: somebody put them there after it was sealed."""
    sums = None if run.path.is_symlink() else read_seal(run.path)
    return [] if sums is None else added(run.path, sums)


def remove(run: Run) -> None:
    """Delete a run, then its tags; of a link that stands for a run, the link.

    It is first renamed, so that no half-deleted run is ever listed; `leftovers` finds what a kill leaves of run and
    tags.
    """
    hidden = _free(run.path.with_name(f".{run.id}{REMOVED}"))
    if run.path.is_symlink():
        run.path.unlink()
    else:
        run.path.rename(hidden)
        delete_folder(hidden)
    if tags := known_tags(run.path.parent).get(run.id):
        change_tags(run.path.parent, run.id, remove=tags)


def _held_by_others(folder: Path) -> Path | None:
    """A folder of the run out of which nothing can be deleted: found before a run is torn to pieces."""
    if folder.is_symlink() or os.statvfs(folder).f_flag & os.ST_RDONLY:  # that is told in other words
        return None
    folders = [folder, *(each for each in folder.rglob("*") if each.is_dir() and not each.is_symlink())]
    return next((each for each in folders if not os.access(each, os.W_OK | os.X_OK)), None)


def _free(path: Path) -> Path:
    """The path, or one like it, where an earlier deletion left something."""
    number = 2
    while path.exists():
        path, number = path.with_name(f"{path.name.removesuffix(REMOVED)}-{number}{REMOVED}"), number + 1
    return path
