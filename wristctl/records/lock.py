"""A held file lock is the sign of life of a run: the kernel frees it however the process ends.

Where a file system has no locks (some NFS, FUSE), the lock file itself has to do: it names the machine, its boot and
the process. One of this machine is looked for; a run of another machine is taken to go on while its file is there.
"""

from __future__ import annotations

import errno
import fcntl
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LOCK = ".lock"
_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL, errno.EBADF)


class RunLock:
    """The lock on a run directory, held from creation to `release`."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / LOCK
        self._descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            os.write(self._descriptor, _myself().encode())
            lock(self._descriptor)
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
        descriptor = os.open(file, os.O_CREAT | os.O_RDWR, 0o666)
    except PermissionError:  # another user's: to hold its lock it need not be written
        descriptor = os.open(file, os.O_RDONLY)
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


def is_locked(directory: Path) -> bool:
    """Whether a living process holds the lock of a run directory."""
    try:
        descriptor = os.open(directory / LOCK, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        with suppress(OSError):
            return _lives(os.read(descriptor, 1000).decode(errors="replace"))
        return False
    finally:
        os.close(descriptor)
    return False


def _myself() -> str:
    return f"{platform.node()} {_boot()} {os.getpid()} {_begun(os.getpid())}\n"


def _lives(holder: str) -> bool:
    """Whether the process that a lock file names is there, as far as this machine can tell."""
    match holder.split():
        case [_, boot, pid, begun] if boot == _boot() and pid.isdigit():
            return _begun(int(pid)) == begun
        case [node, _, _, _]:
            return node != platform.node()
    return False


def _boot() -> str:
    with suppress(OSError):
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return "-"


def _begun(pid: int) -> str:
    """When a process began, in the kernel's ticks: a number is given to another process one day."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    return "-"
