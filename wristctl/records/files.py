"""Files that are either whole or absent, even after a power cut, and their hashes."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.system_errors import fix_of

PART = ".part"
"""End of the hidden name of a file that is being written."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path to write to, which takes the place of `path` at once when the block ends well.

    Raises UserError where the file system refuses (no space, no permission). The folder must be there: one that was
    removed meanwhile does not come back.
    """
    temporary = path.with_name(f".{path.name}{PART}")
    try:
        yield temporary
        sync(temporary)
        temporary.replace(path)
        sync(path.parent)
    except OSError as error:
        raise UserError(f"cannot write: {error.strerror or error}", str(path), fix_of(error)) from error
    finally:
        with suppress(OSError):  # read-only, or gone: what is told is why it could not be written
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def sync(path: Path) -> None:
    """Wait until a file or directory is on the disk, where its file system can tell."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP):
            raise
    finally:
        os.close(descriptor)


def sha256_of(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of_list(items: list[tuple[str, str]]) -> str:
    """One hash over (name, hash) pairs, whatever their order."""
    text = "".join(f"{digest}  {name}\n" for name, digest in sorted(items))
    return hashlib.sha256(text.encode()).hexdigest()


def files_below(directory: Path) -> list[str]:
    """Relative POSIX paths of all files below, hidden ones left out, sorted."""
    found = (path.relative_to(directory) for path in directory.rglob("*") if path.is_file())
    return sorted(path.as_posix() for path in found if not any(part.startswith(".") for part in path.parts))
