"""Runs deleted on request, and what killed processes left in a results folder."""

import os
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from wristctl.errors import UserError
from wristctl.records.copied_inputs import INPUTS
from wristctl.records.files import PART
from wristctl.records.index import TEMPORARY, dated, run_names
from wristctl.records.lineage import dependents
from wristctl.records.lock import LOCK, delete_folder, is_locked, locked
from wristctl.records.manifest import CONFIG, CONSOLE, EVENTS, PACKAGES, PATCH, SOURCES, SUMS
from wristctl.records.run import Run
from wristctl.records.run_writer import RESERVE
from wristctl.records.seal import SIGNING, added
from wristctl.records.tags import LOCK_OF_TAGS, TAGS, change_tags, known_tags
from wristctl.sha256sums import read_seal

# End of the hidden name under which a run is deleted.
REMOVED = ".removed"


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
    hidden, number = run.path.with_name(f".{run.id}{REMOVED}"), 2
    while hidden.exists():  # an earlier deletion left something
        hidden, number = hidden.with_name(f".{run.id}-{number}{REMOVED}"), number + 1
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
    folders = [
        folder,
        *(subfolder for subfolder in folder.rglob("*") if subfolder.is_dir() and not subfolder.is_symlink()),
    ]
    return next((subfolder for subfolder in folders if not os.access(subfolder, os.W_OK | os.X_OK)), None)


# All that a run may have written before its manifest.
_BEGINNING = {CONFIG, CONSOLE, EVENTS, PACKAGES, PATCH, SOURCES, RESERVE, LOCK, INPUTS}

# Beginning of the name of a scratch folder; its lock is gone once the repetition has ended.
SCRATCH = "wristctl-replay-"


class Leftover(NamedTuple):
    """Something to delete, and what it was; `size` in bytes."""

    path: Path
    what: str
    size: int


def leftovers(results: Path) -> Iterator[Leftover]:
    """Half-deleted runs, half-written files, the reserves of crashed runs, and folders in which no run began."""
    for path in sorted(results.glob(".*")):
        if is_locked(path):
            continue
        with suppress(FileNotFoundError):  # another process has deleted it meanwhile
            if path.name.endswith(REMOVED) and path.is_dir():
                yield Leftover(path, "a run that was being deleted", _size(path))
            elif path.name.startswith(TEMPORARY) or path.name.endswith(PART):
                yield Leftover(path, "a file or folder that was being written", _size(path))
    for name in run_names(results):
        with suppress(FileNotFoundError):
            yield from _left_in(results / name)


def _left_in(run: Path) -> list[Leftover]:
    """The run itself where it never began, or what it left within its folder."""
    if run.is_symlink() or is_locked(run) or not os.access(run, os.R_OK | os.X_OK):
        return []
    if _began_no_run(run):
        return [Leftover(run, "a run that was killed before it began", _size(run))]
    sealed, left_behind = (run / SUMS).exists(), []
    for path in sorted(run.rglob(".*")):
        unfinished = not sealed and (path.name == RESERVE or path.name.endswith(PART))
        if unfinished or path in (run / LOCK, run / SIGNING):
            left_behind.append(Leftover(path, "left by a run that was killed", _size(path)))
    return left_behind


def lost_repetitions() -> Iterator[Leftover]:
    """Scratch folders of your replays that were killed."""
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{SCRATCH}*")):
        status = folder.lstat()
        yours = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()
        if yours and (folder / LOCK).exists() and not is_locked(folder):
            yield Leftover(folder, "of a replay that was killed", _size(folder))


def lost_tags(results: Path) -> dict[str, list[str]]:
    """Tags of runs that are gone."""
    present = set(run_names(results))
    return {run: tags for run, tags in known_tags(results).items() if run not in present}


def clear(leftover: Leftover) -> None:
    """Delete it."""
    if leftover.path.is_dir() and not leftover.path.is_symlink():
        delete_folder(leftover.path)
    elif leftover.path.name == f".{TAGS}{PART}":
        with locked(leftover.path.parent / LOCK_OF_TAGS):  # whoever writes tags has it
            leftover.path.unlink(missing_ok=True)
    else:
        leftover.path.unlink(missing_ok=True)


def clear_tags(results: Path, lost: dict[str, list[str]]) -> None:
    """Take off tags of runs that are gone."""
    for run, tags in lost.items():
        change_tags(results, run, remove=tags)


def _began_no_run(folder: Path) -> bool:
    """Whether a folder holds only what a run writes before its manifest: anything else is somebody's."""
    names = {item.name for item in folder.iterdir()}
    begun = {name for name in names if name in _BEGINNING or (name.startswith(".") and name.endswith(PART))}
    folders = {item.name for item in folder.iterdir() if item.is_dir()}
    return names == begun and dated(folder.name) != "" and folders <= {INPUTS}


def _size(path: Path) -> int:
    files = [path] if not path.is_dir() or path.is_symlink() else path.rglob("*")
    return sum(item.lstat().st_size for item in files if item.is_symlink() or item.is_file())
