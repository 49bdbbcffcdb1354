"""Files that are opened to be read: plain ones, of a size that somebody may have meant, so that reading them ends."""

import errno
import io
import json
import os
import stat
from pathlib import Path
from typing import Any

from wristctl.errors import UserError, fix_to_read

_LINK = "a link, and a run holds files only"
LINK, NOT_PLAIN, UNREADABLE = f"is {_LINK}", "is no plain file", "cannot be read: "
# Most bytes of a text that is read whole, and of data.
LARGEST, LARGEST_DATA = 1 << 28, 1 << 33
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


def open_plain(file: Path, largest: int = LARGEST, links: bool = True) -> io.BufferedReader:
    """Open a file for reading. OSError for what is no plain file, which might never end, or too large.

    Parameters
    ----------
    file
        Path of the file.
    largest
        Most bytes that it may have.
    links
        Whether it may be a link to such a file.
    """
    _check(file, os.stat(file, follow_symlinks=links), largest)  # first: to open a device may do something
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if links else os.O_NOFOLLOW))
    try:
        _check(file, os.fstat(descriptor), largest)
    except OSError:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def read_plain(file: Path, largest: int = LARGEST, links: bool = True) -> bytes:
    """Content of a file. Raises OSError like `open_plain`."""
    with open_plain(file, largest, links) as stream:
        return stream.read()


def read_text(file: Path, largest: int = LARGEST, encoding: str = "utf-8") -> str:
    """Text of a file. Raises OSError like `open_plain`, and ValueError where it is no such text."""
    with io.TextIOWrapper(open_plain(file, largest), encoding) as stream:
        return stream.read()


def read_json(file: Path, links: bool = True) -> Any:
    """JSON of a file. Raises OSError like `open_plain`, and ValueError where it is none, or nested too deeply."""
    try:
        return json.loads(read_plain(file, links=links))
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def unreadable(error: OSError, file: Path) -> UserError:
    """The user's error of a file that may be as it was, if only it could be read."""
    return UserError(f"{UNREADABLE}{error.strerror or error}", str(file), fix_to_read(error))


def _check(file: Path, status: os.stat_result, largest: int) -> None:
    if stat.S_ISLNK(status.st_mode):
        raise OSError(errno.ELOOP, _LINK, str(file))
    if not stat.S_ISREG(status.st_mode):
        kind = _KINDS.get(stat.S_IFMT(status.st_mode), "something else")
        number = errno.EISDIR if stat.S_ISDIR(status.st_mode) else errno.EINVAL
        raise OSError(number, f"{kind}, and no plain file", str(file))
    if status.st_size > largest:
        sizes = f"{status.st_size / 1e6:.0f} MB, and {largest / 1e6:.0f} MB are read at most"
        raise OSError(errno.EFBIG, sizes, str(file))
