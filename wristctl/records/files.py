"""Files that are either whole or absent, even after a power cut, and their hashes."""

import errno
import hashlib
import os
import stat
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from wristctl.errors import OUT, Phrase, UserError, writing
from wristctl.plain_files import LARGEST, LARGEST_DATA, LINK, NOT_PLAIN, open_plain, read_plain, unreadable

# End of the hidden name of a file that is being written.
PART = ".part"
# Files whose way to the disk is waited for at the same time.
_AT_ONCE = 16


@contextmanager
def replacing(path: Path, by: Phrase = OUT) -> Iterator[Path]:
    """A temporary path to write to, which takes the place of `path` at once when the block ends well.

    Raises UserError where the file system refuses (no space, no permission); there is no new file then, and `by` is the
    argument that names another place. The folder must be there: one that was removed meanwhile does not come back.
    """
    temporary = path.with_name(f".{path.name}{PART}")
    fresh = not os.path.lexists(path)
    try:
        with writing(path, by):
            yield temporary
            sync(temporary)
            temporary.replace(path)
            try:
                sync(path.parent)
            except OSError:
                if fresh:
                    path.unlink()
                raise
    finally:
        with suppress(OSError):  # read-only, or gone: what is told is why it could not be written
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str, by: Phrase = OUT) -> None:
    """Write UTF-8 text, whole or not at all."""
    with replacing(path, by) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def content_of(path: Path, largest: int = LARGEST, links: bool = True) -> bytes:
    """Content of a plain file of at most so many bytes. Raises UserError where it cannot be read."""
    try:
        return read_plain(path, largest, links)
    except OSError as error:
        raise unreadable(error, path) from error


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


def check_plain(path: Path) -> None:
    """UserError for a link, a pipe or a device where a run has a file; nothing is opened. OSError where it is gone."""
    mode = path.lstat().st_mode
    if not stat.S_ISREG(mode):
        problem = LINK if stat.S_ISLNK(mode) else NOT_PLAIN
        raise UserError(problem, str(path), "put a copy of its content in its place", exit_code=3)


def sync_all(paths: Iterable[Path]) -> None:
    """Wait until files are on the disk, many at once: one after the other each takes a turn of the disk."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        list(pool.map(sync, paths))


def sha256_of(path: Path, largest: int = LARGEST_DATA) -> str:
    """SHA-256 of a file of at most so many bytes."""
    with open_plain(path, largest) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of_list(items: list[tuple[str, str]]) -> str:
    """One hash over (name, hash) pairs, whatever their order."""
    text = "".join(f"{digest}  {name}\n" for name, digest in sorted(items))
    return hashlib.sha256(text.encode()).hexdigest()


def files_below(directory: Path) -> list[str]:
    """Relative POSIX paths of all files below, hidden ones left out, sorted."""
    paths = (path.relative_to(directory) for path in directory.rglob("*") if path.is_file())
    return sorted(path.as_posix() for path in paths if not any(part.startswith(".") for part in path.parts))
