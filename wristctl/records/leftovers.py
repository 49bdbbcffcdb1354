"""What processes that were killed have left in a results folder, and nobody needs."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from wristctl.records.files import PART
from wristctl.records.index import TEMPORARY, dated, run_names
from wristctl.records.live import RESERVE
from wristctl.records.lock import LOCK, delete_folder, is_locked, locked
from wristctl.records.manifest import CONFIG, CONSOLE, EVENTS, PACKAGES, PATCH, SOURCES, SUMS
from wristctl.records.remove import REMOVED
from wristctl.records.seal import SIGNING
from wristctl.records.sealed_files import INPUTS
from wristctl.records.tags import LOCK_OF_TAGS, TAGS, change_tags, known_tags

_BEGINNING = {CONFIG, CONSOLE, EVENTS, PACKAGES, PATCH, SOURCES, RESERVE, LOCK, INPUTS}
"""All that a run may have written before its manifest."""

SCRATCH = "wristctl-replay-"
"""Beginning of the name of a scratch folder; its lock is gone once the repetition has ended."""


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
    sealed, found = (run / SUMS).exists(), []
    for path in sorted(run.rglob(".*")):
        unfinished = not sealed and (path.name == RESERVE or path.name.endswith(PART))
        if unfinished or path in (run / LOCK, run / SIGNING):
            found.append(Leftover(path, "left by a run that was killed", _size(path)))
    return found


def lost_repetitions() -> Iterator[Leftover]:
    """Scratch folders of your replays that were killed."""
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{SCRATCH}*")):
        found = folder.lstat()
        yours = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
        if yours and (folder / LOCK).exists() and not is_locked(folder):
            yield Leftover(folder, "of a replay that was killed", _size(folder))


def lost_tags(results: Path) -> dict[str, list[str]]:
    """Tags of runs that are gone."""
    there = set(run_names(results))
    return {run: tags for run, tags in known_tags(results).items() if run not in there}


def clear(found: Leftover) -> None:
    """Delete it."""
    if found.path.is_dir() and not found.path.is_symlink():
        delete_folder(found.path)
    elif found.path.name == f".{TAGS}{PART}":
        with locked(found.path.parent / LOCK_OF_TAGS):  # whoever writes tags has it
            found.path.unlink(missing_ok=True)
    else:
        found.path.unlink(missing_ok=True)


def clear_tags(results: Path, lost: dict[str, list[str]]) -> None:
    """Take off tags of runs that are gone."""
    for run, tags in lost.items():
        change_tags(results, run, remove=tags)


def _began_no_run(folder: Path) -> bool:
    """Whether a folder holds only what a run writes before its manifest: anything else is somebody's."""
    names = {each.name for each in folder.iterdir()}
    begun = {name for name in names if name in _BEGINNING or (name.startswith(".") and name.endswith(PART))}
    folders = {each.name for each in folder.iterdir() if each.is_dir()}
    return names == begun and dated(folder.name) != "" and folders <= {INPUTS}


def _size(path: Path) -> int:
    files = [path] if not path.is_dir() or path.is_symlink() else path.rglob("*")
    return sum(each.lstat().st_size for each in files if each.is_symlink() or each.is_file())
