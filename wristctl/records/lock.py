"""A held file lock is the sign of life of a run: the kernel frees it however the process ends."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

_NAME = ".lock"


class RunLock:
    """The lock on a run directory, held from creation to `release`."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / _NAME
        self._descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR, 0o644)
        fcntl.flock(self._descriptor, fcntl.LOCK_EX)

    def release(self) -> None:
        """Let go and leave no trace."""
        self._path.unlink(missing_ok=True)
        os.close(self._descriptor)


def is_locked(directory: Path) -> bool:
    """Whether a living process holds the lock of a run directory."""
    try:
        descriptor = os.open(directory / _NAME, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return False
