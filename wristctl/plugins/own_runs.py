"""Runs with code that this user sealed on this machine, each by its seal: their code has run on the user's word.

The record is `wristctl/own_runs` in XDG_STATE_HOME (~/.local/state), a hash a line. It counts only where nobody else
can have written it: the file is the user's, and no folder above it is another user's or writable by others.
"""

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

_WRITABLE_BY_OTHERS = 0o022


def note(sums: Mapping[str, str]) -> None:
    """Record a run that was sealed just now; `sums` are the hashes in its seal by name.

    Where the record cannot be written, or is not the user's alone, the run is not recorded.
    """
    with suppress(OSError, RuntimeError):
        file = _file()
        for folder in reversed(file.parents):
            if not folder.exists():
                folder.mkdir(mode=0o700, exist_ok=True)
        with _opened(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT) as descriptor:
            os.write(descriptor, f"{_digest(sums)}\n".encode())


def is_noted(sums: Mapping[str, str]) -> bool:
    """Whether a run with this seal is recorded, in a record that is the user's alone."""
    try:
        with _opened(_file(), os.O_RDONLY) as descriptor, open(descriptor, "rb", closefd=False) as record:
            return _digest(sums).encode() in record.read().split()
    except (OSError, RuntimeError):
        return False


def _file() -> Path:
    """RuntimeError or FileNotFoundError where the user has no home."""
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    if not state.is_absolute():  # else it would be the working folder's, whose files may be from anywhere
        raise FileNotFoundError(f"{state} is no home")
    return state / "wristctl" / "own_runs"


@contextmanager
def _opened(file: Path, flags: int) -> Iterator[int]:
    """The record's descriptor. PermissionError where others could have written it."""
    descriptor = os.open(file, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o600)
    try:
        status = os.fstat(descriptor)
        alone = status.st_uid == os.geteuid() and status.st_nlink == 1
        if not alone or status.st_mode & _WRITABLE_BY_OTHERS or not all(map(_is_safe, _folders(file))):
            raise PermissionError(f"{file} is not this user's alone")
        yield descriptor
    finally:
        os.close(descriptor)


def _folders(file: Path) -> set[Path]:
    """Folders above a file, by its name and by where that leads."""
    return {*file.parents, *file.resolve().parents}


def _is_safe(folder: Path) -> bool:
    """Whether nobody but the user and root can put another folder or file in the place of what is in it."""
    status = folder.lstat()
    if status.st_uid not in (0, os.geteuid()):
        return False
    sticky = status.st_mode & stat.S_ISVTX
    return stat.S_ISLNK(status.st_mode) or bool(sticky) or not status.st_mode & _WRITABLE_BY_OTHERS


def _digest(sums: Mapping[str, str]) -> str:
    lines = (f"{digest}  {name}\n" for name, digest in sums.items())
    return hashlib.sha256("".join(lines).encode(errors="surrogateescape")).hexdigest()
