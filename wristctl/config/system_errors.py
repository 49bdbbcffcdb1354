"""What the disk or the system refuses is the user's to mend, and no bug."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.wording import OUT, Phrase

_SPACE: Phrase = ("free space or choose another ", OUT)
_ELSEWHERE: Phrase = ("choose a folder you can write to with ", OUT)
_FIXES: dict[int, Phrase] = {
    errno.ENOSPC: _SPACE,
    errno.EDQUOT: _SPACE,
    errno.EIO: ("check the disk, or choose another ", OUT),
    errno.EFBIG: ("raise the limit on files (ulimit -f), or choose another ", OUT),
    errno.EROFS: _ELSEWHERE,
    errno.EACCES: _ELSEWHERE,
    errno.EPERM: _ELSEWHERE,
    errno.ESTALE: _ELSEWHERE,
    errno.ENXIO: _ELSEWHERE,
    errno.ENOTCONN: _ELSEWHERE,
    errno.ETIMEDOUT: _ELSEWHERE,
    errno.EREMOTEIO: _ELSEWHERE,
    errno.ENOLCK: _ELSEWHERE,
    errno.EMFILE: "raise the limit on open files (ulimit -n)",
    errno.ENFILE: "close other programs: the system has no more open files to give",
    errno.ENOMEM: "close other programs, or ask for less at once",
    errno.EAGAIN: "close other programs: the system has no more processes to give",
    errno.ENAMETOOLONG: ("shorten the name, or choose a shorter path with ", OUT),
    errno.ELOOP: "mend the links on the way to it",
    errno.ENOENT: "make its folder; one that is in use must stay where it is",
    errno.ENOTDIR: ("a file stands where the path has a folder: move it, or choose another ", OUT),
    errno.EEXIST: ("a file is in the way: move it, or choose another ", OUT),
    errno.EISDIR: "a folder is in the way: move it, or name another file",
    errno.ENOTEMPTY: "leave the folder alone meanwhile, and try again",
    errno.EBUSY: "leave the folder alone meanwhile, and try again",
    errno.EXDEV: _ELSEWHERE,
}
"""What helps where the system refuses, by errno."""

_TO_READ: dict[int, Phrase] = {
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: a file stands where it has a folder",
    errno.EISDIR: "name a file in that folder",
    errno.ENAMETOOLONG: "shorten the path",
    errno.EACCES: "ask its owner to let you read it",
    errno.EPERM: "ask its owner to let you read it",
    errno.EIO: "check the disk that it is on, or bring a copy",
    errno.ESTALE: "check the disk that it is on, or bring a copy",
}
"""What helps where a file cannot be read, where it is another thing than where one cannot be written."""

_WRITING = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)


def error_of_the_system(error: BaseException, place: Path | str = "") -> UserError | None:
    """The user's error where the disk or the system has refused; None of an error that is ours."""
    if isinstance(error, MemoryError):
        return UserError(f"not enough memory: {error}".rstrip(": "), str(place), _FIXES[errno.ENOMEM])
    if isinstance(error, OSError) and error.errno in _FIXES:
        where = error.filename if isinstance(error.filename, str) else place
        what = "cannot write" if error.errno in _WRITING else "the system refuses"
        return UserError(f"{what}: {error.strerror}", str(where), _FIXES[error.errno])
    return None


def fix_of(error: OSError, by: Phrase = OUT) -> Phrase:
    """What helps where something could not be written; `by` is the argument that names another place."""
    fix = _FIXES.get(error.errno or 0, _ELSEWHERE)
    return tuple(by if part is OUT else part for part in fix) if isinstance(fix, tuple) else fix


def fix_to_read(error: OSError) -> Phrase:
    """What helps where something could not be read."""
    return _TO_READ.get(error.errno or 0) or _FIXES.get(error.errno or 0, "bring a copy that can be read")


@contextmanager
def writing(place: Path, by: Phrase = OUT) -> Iterator[None]:
    """Within the block what the system refuses is the user's error of a place that cannot be written.

    `by` is the argument that names another place.
    """
    try:
        yield
    except OSError as error:
        raise UserError(f"cannot write: {error.strerror or error}", str(place), fix_of(error, by)) from error
