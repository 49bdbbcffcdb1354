"""Files that are either whole or absent, even after a power cut, and their hashes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.wording import OUT


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path to write to, which takes the place of `path` at once when the block ends well.

    Raises UserError where the file system refuses (no space, no permission).
    """
    temporary = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        sync(temporary)
        temporary.replace(path)
        sync(path.parent)
    except OSError as error:
        raise UserError(
            f"cannot write: {error.strerror or error}", str(path), ("free space or choose another ", OUT)
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def sync(path: Path) -> None:
    """Wait until a file or directory is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
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
