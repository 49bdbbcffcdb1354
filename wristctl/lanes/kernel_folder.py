"""Where compiled kernels are kept: in a folder that this user alone may write, for what is in it is loaded and run.

Whoever may write a folder, or one on the way to it, may put a file of his own there. The owner of the root of the file
system may do so anyway. A group that is the user's alone counts as the user: systems with a umask of 002 make one for
each.
"""

import grp
import logging
import os
import pwd
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

# Environment variable that names another folder.
NAMED = "WRISTCTL_KERNELS"
_SHARED = ("nfs", "nfs4", "lustre", "gpfs", "beegfs", "cifs", "smb3", "ceph", "afs", "panfs", "glusterfs", "fuse.sshfs")
_MOUNTS = Path("/proc/self/mounts")

_log = logging.getLogger(__name__)


def kernels_folder() -> Path | None:
    """The folder, made where it is not there yet; None where none is this user's alone. Then nothing is kept.

    A warning names one that others may write; processes that are started from here are told of the one in its place.
    Raises OSError where it cannot be made, and RuntimeError where the user has no home.
    """
    usual = Path(os.environ.get(NAMED) or _usual()).resolve()
    if not (fault := _made(usual)):
        return usual
    other = _of_this_machine().resolve()
    instead = other if other != usual and not _made(other) else None
    _log.warning(
        "compiled kernels in %s are not used: %s; they are kept in %s", usual, fault, instead or "memory alone"
    )
    if instead is not None:
        os.environ[NAMED] = str(instead)
    return instead


def own_folder(folder: Path) -> bool:
    """Make a folder within that of all kernels; whether it and its files are this user's alone.

    One that is not is deleted with a warning, where that can be done, and made anew.
    """
    for _ in range(2):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_own(folder.lstat()) and all(_is_own(status, within=folder) for status in _files(folder)):
            return True
        _log.warning("compiled kernels in %s are not used: others may have written them", folder)
        shutil.rmtree(folder, ignore_errors=True)
    return False


def _files(folder: Path) -> Iterator[os.stat_result]:
    for file in folder.iterdir():
        try:
            yield file.lstat()
        except FileNotFoundError:  # another process has just renamed it
            continue


def is_shared(folder: Path) -> bool:
    """Whether a folder lies on a file system of a network."""
    try:
        mounts = [line.split()[1:3] for line in _MOUNTS.read_text(encoding="utf-8").splitlines()]
    except OSError:
        return False
    place = folder.resolve()
    below = [(len(point), kind) for point, kind in mounts if place.is_relative_to(_unescaped(point))]
    return bool(below) and max(below)[1] in _SHARED


def _unescaped(point: str) -> str:
    return point.encode().decode("unicode_escape") if "\\" in point else point


def _usual() -> Path:
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wristctl" / "kernels"
    return _of_this_machine() if is_shared(usual) else usual


def _of_this_machine() -> Path:
    """Folder of this machine's own file system."""
    return Path(tempfile.gettempdir()) / f"wristctl-kernels-{os.geteuid()}"


def _made(folder: Path) -> str:
    """Why a folder, which is made where it can be, is not this user's alone; empty where it is."""
    if fault := _fault_on_the_way(folder):
        return fault
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    for place in reversed(missing):
        place.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    if status.st_uid != os.geteuid():
        return f"it is of user {status.st_uid}"
    return "" if _is_own(status) else f"others may write it, mend it by chmod go-w {folder}"


def _fault_on_the_way(folder: Path) -> str:
    """Why somebody else may put a folder in the place of this one or of one above it; empty where nobody may."""
    trusted = {0, os.geteuid(), Path("/").stat().st_uid}
    for place, status in _there(folder):
        if status.st_uid not in trusted:
            return f"{place} is of user {status.st_uid}"
        if _others_may_write(status) and not status.st_mode & stat.S_ISVTX:
            return f"others may write {place}"
    return ""


def _there(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    """The folders above this one that are there, with their states."""
    for place in folder.parents:
        try:
            yield place, place.lstat()
        except FileNotFoundError:
            continue


def _is_own(status: os.stat_result, within: Path | None = None) -> bool:
    """Whether a folder or a plain file is this user's, and writable by nobody else: none may enter a closed folder."""
    plain = stat.S_ISDIR(status.st_mode) or stat.S_ISREG(status.st_mode)
    closed = within is not None and not within.lstat().st_mode & 0o077
    return plain and status.st_uid == os.geteuid() and (closed or not _others_may_write(status))


def _others_may_write(status: os.stat_result) -> bool:
    by_group = bool(status.st_mode & stat.S_IWGRP) and not _is_users_own(status.st_gid)
    return by_group or bool(status.st_mode & stat.S_IWOTH)


def _is_users_own(group_id: int) -> bool:
    """Whether a group has the user's name, and nobody else in it."""
    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(group_id)
    except KeyError:
        return False
    return user.pw_gid == group_id and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
