"""A held file lock is the sign of life of a run: the kernel frees it however the process ends.

Where a file system has no locks (some NFS, FUSE), the file itself has to do: its run goes on while it is there.
"""

import errno
import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

LOCK = ".lock"
# A lock that is a link would make, or hold, a file elsewhere; one that is a pipe would wait.
_PLAIN = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL, errno.EBADF)


class RunLock:
    """The lock on a folder that is being written, held until `release`. FileNotFoundError where the folder is gone."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / LOCK
        self._descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR | _PLAIN, 0o666)
        try:
            lock(self._descriptor)
            self._path.stat()  # gone where `runs gc` had the lock before, and took the new folder away
        except OSError:
            os.close(self._descriptor)
            raise

    def release(self) -> None:
        """Let go and leave no trace, where that can be done: what is left is free."""
        with suppress(OSError):
            if os.fstat(self._descriptor).st_ino == os.stat(self._path).st_ino:
                self._path.unlink()
        os.close(self._descriptor)


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Within the block no other process has the lock of this file, which is made where it is not there."""
    try:
        descriptor = os.open(file, os.O_CREAT | os.O_RDWR | _PLAIN, 0o666)
    except PermissionError:  # another user's: to hold its lock it need not be written
        descriptor = os.open(file, os.O_RDONLY | _PLAIN)
    try:
        lock(descriptor)
        yield
    finally:
        os.close(descriptor)


def lock(descriptor: int) -> None:
    """Wait for a file's lock and take it; nothing where the file system has none."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise


def is_locked(path: Path) -> bool:
    """Whether a living process holds the lock of a folder or of a file, as far as its file system can tell."""
    try:
        descriptor = os.open(path / LOCK if path.is_dir() else path, os.O_RDONLY | _PLAIN)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return isinstance(error, BlockingIOError) or error.errno in _NO_LOCKS
    finally:
        os.close(descriptor)
    return False


def delete_folder(directory: Path) -> None:
    """Delete a folder with all that is in it, unless somebody has its lock.

    The lock is held meanwhile, so that two who delete it are not in each other's way, and a process that has just made
    the folder, and waits for its lock, finds that it is gone.
    """
    descriptor = None
    try:
        descriptor = os.open(directory / LOCK, os.O_CREAT | os.O_RDWR | _PLAIN, 0o666)
    except FileNotFoundError:
        return
    except OSError:  # a full disk has no room for a lock, and may have some again after this
        pass
    try:
        if descriptor is None or _taken(descriptor):
            _empty(directory)
            shutil.rmtree(directory, onerror=_unless_another_did)
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _empty(directory: Path) -> None:
    """Delete all but the lock, which goes last: who takes it then finds nothing, or a folder that is gone."""
    with suppress(FileNotFoundError):
        for item in sorted(directory.iterdir()):
            if item.is_dir() and not item.is_symlink():
                shutil.rmtree(item, onerror=_unless_another_did)
            elif item.name != LOCK:
                item.unlink(missing_ok=True)


def _unless_another_did(function: Any, path: str, raised: Any) -> None:
    """Raise what a deletion met, unless another process has deleted the same, or is about to."""
    error = raised[1]
    if not isinstance(error, FileNotFoundError) and getattr(error, "errno", 0) != errno.ENOTEMPTY:
        raise error


def _taken(descriptor: int) -> bool:
    """Take a file's lock where nobody has it; also where the file system has none."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # no room for a lock, or no locks at all
        pass
    return True
