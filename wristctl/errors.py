"""Errors that are the user's to mend, as against bugs: what is wrong, where, and how to mend it."""

from __future__ import annotations

import difflib
import errno
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

_FUNCTIONS = {
    "gen-data": "gen_data", "train": "train", "tune": "tune", "compare": "compare", "simulate": "simulate",
    "analyse": "analyse", "identify": "identify", "paper audit": "audit", "runs ls": "runs",
    "hw-run": "hw_run",
}  # fmt: skip
"""The function of each command that Python has; the others are called at the shell from there too."""


@dataclass(frozen=True)
class Argument:
    """An argument of a command by name: `--network RUN` or `--newer 2d`, in Python `network=...` or `newer='2d'`."""

    name: str
    value: str | None = None
    """None: any"""
    metavar: str = "RUN"
    """Word of the command line for any value, such as RUN; empty: none."""
    positional: bool = False
    """whether the command line takes it without its name"""
    quoted: bool = False
    """whether a shell needs quotes about the value"""

    @property
    def typed(self) -> str:
        """On the command line."""
        option = "" if self.positional else f"--{self.name.replace('_', '-')}"
        value = self.metavar if self.value is None else f"'{self.value}'" if self.quoted else self.value
        return " ".join(part for part in (option, value) if part)

    @property
    def in_python(self) -> str:
        """As an argument of the function."""
        return f"{self.name}=..." if self.value is None else f"{self.name}={self.value!r}"


@dataclass(frozen=True)
class Setting:
    """A leaf set beside the study's files: `--set fix.friction=0.1`, or an override of `load_study`."""

    text: str
    """key=value, as it was typed or would be"""
    section: str = ""
    """the command whose section the key is looked for in; load_study wants it in front"""
    option: str = ""
    """the same by an option that the command has: `--source run`"""
    quoted: bool = False
    """whether a shell needs quotes about it"""

    @property
    def typed(self) -> str:
        """On the command line."""
        if self.option:
            return self.option
        return f"--set '{self.text}'" if self.quoted else f"--set {self.text}"

    @property
    def in_python(self) -> str:
        """As an override of load_study."""
        return f"load_study(..., {'.'.join(part for part in (self.section, self.text) if part)!r})"


@dataclass(frozen=True)
class Keyword(Setting):
    """A setting given to a function by keyword: `simulate(controller='pid-ff')`; its text ends the same way."""

    function: str = ""

    @property
    def in_python(self) -> str:
        """As the call has it."""
        return f"{self.function}({self.text})"

    @property
    def typed(self) -> str:
        """The same, where the command line has no option for it."""
        return self.option or self.in_python


@dataclass(frozen=True)
class Call:
    """A command with what it is given: `wristctl gen-data --run latest:simulate`, or the function of that name."""

    command: str
    """Words of the command: train, runs ls, hw calibrate camera."""
    file: str = ""
    """a study file"""
    arguments: tuple[Argument, ...] = ()
    kept: bool = False
    """whether it is to leave a run, for which a function needs a folder"""

    @property
    def typed(self) -> str:
        """On the command line."""
        words = ("wristctl", self.command, self.file, *(each.typed for each in self.arguments))
        return " ".join(word for word in words if word)

    @property
    def in_python(self) -> str:
        """As a call; a command without a function as it is typed."""
        name = _FUNCTIONS.get(self.command)
        if name is None:
            return self.typed
        study = f"load_study({self.file!r})" if self.file else "study"
        given = [study] if name != "runs" else []
        arguments = [*self.arguments, OUT] if self.kept else self.arguments
        return f"wristctl.{name}({', '.join([*given, *(each.in_python for each in arguments)])})"


OUT = Argument("out", metavar="")
"""The folder of run directories, whichever it may be."""
FILE, TO = Argument("file", metavar=""), Argument("to", metavar="")
"""Arguments that name where a command writes that makes no run."""

Phrase = str | Argument | Setting | Call | tuple["Phrase", ...]
"""Text with such parts in it: `("give ", Argument("table1"))`."""


def worded(phrase: Phrase, in_python: bool = False) -> str:
    """A phrase as text, in the words of the command line or in Python's."""
    if isinstance(phrase, tuple):
        return "".join(worded(part, in_python) for part in phrase)
    if isinstance(phrase, str):
        return phrase
    return phrase.in_python if in_python else phrase.typed


_TOLD = 30
"""Choices that an error names."""


class UserError(Exception):
    """Something the user can mend: what is wrong, where (file, line, key path), how to fix it.

    `exit_code` is 2 for usage and configuration, 3 for a failed check, 4 for hardware, 5 for a safety stop. Place and
    fix may be phrases with arguments, settings and commands in them, which are worded as the command line has them, or,
    where `in_python` is set on the way to a notebook, as Python has them.
    """

    in_python = False

    def __init__(self, what: str, where: Phrase = "", fix: Phrase = "", exit_code: int = 2) -> None:
        super().__init__(what, where, fix, exit_code)
        self.what, self.exit_code = what, exit_code
        self._where, self._fix = where, fix

    @property
    def where(self) -> str:
        """File, line and key path, or whatever tells the place."""
        return worded(self._where, self.in_python)

    @property
    def fix(self) -> str:
        """Advice on how to mend the error."""
        return worded(self._fix, self.in_python)

    def at(self, where: Phrase) -> UserError:
        """Copy of the error that names a more exact place."""
        return UserError(self.what, where, self._fix, self.exit_code)

    def __str__(self) -> str:
        parts = [self.what, self.where, self.fix and f"fix: {self.fix}"]
        return " ".join(" - ".join(part for part in parts if part).split())


class Unfitting(ValueError):
    """Settings of which each may be so, but not beside the others."""

    def __init__(self, what: str, fix: str) -> None:
        super().__init__(what)
        self.fix = fix


@contextmanager
def under(path: str) -> Iterator[None]:
    """Let an error of the block, which names a key or a file, say that the key stands below this key path."""
    try:
        yield
    except UserError as error:
        if error.where.startswith("/"):
            raise
        raise error.at(f"{path}.{error.where}" if error.where else path) from error


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """The choice most like `word`, None where none is alike; capitals, and _ for -, make no difference.

    Of choices whose first words are `word` it is the shortest: pd-ff of pd.
    """
    known = list(choices)
    if whole := [choice for choice in known if plain(choice).startswith(f"{plain(word)}-")]:
        return min(whole, key=len)
    if not (matches := difflib.get_close_matches(plain(word), map(plain, known), n=1, cutoff=0.6)):
        return None
    alike = [choice for choice in known if plain(choice) == matches[0]]
    return max(alike, key=lambda choice: difflib.SequenceMatcher(None, word, choice).ratio())


def plain(name: str) -> str:
    """A name without capitals, its words joined by -."""
    return name.casefold().replace("_", "-")


def meant(word: str, choices: Iterable[str]) -> str:
    """Advice on an unknown `word`: the nearest choice, else all of them, or the first of very many."""
    known = sorted(choices)
    best = nearest(word, known)
    more = f" and {len(known) - _TOLD} more" if len(known) > _TOLD else ""
    return f"did you mean {best!r}?" if best else f"one of {', '.join(known[:_TOLD])}{more}"


def reason_of(error: BaseException) -> str:
    """An error in one line: the user's as it is, any other after its type."""
    text = str(error) if isinstance(error, UserError) else f"{type(error).__name__}: {error}".rstrip(": ")
    return " ".join(text.split())


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
"""Advice where the system refuses, by errno."""

_TO_READ: dict[int, Phrase] = {
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: a file stands where it has a folder",
    errno.EISDIR: "name a file in that folder",
    errno.ENAMETOOLONG: "shorten the path",
    errno.EACCES: "ask its owner to let you read it",
    errno.EPERM: "ask its owner to let you read it",
    errno.EIO: "check the disk that it is on, or bring a copy",
    errno.ESTALE: "check the disk that it is on, or bring a copy",
    errno.EINVAL: "put a plain file in its place",
    errno.ELOOP: "put a copy of what was meant in its place",
    errno.EFBIG: "bring the file that was meant",
}
"""Advice where a file cannot be read, where it differs from that on writing, by errno."""

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
    """Advice where something could not be written; `by` is the argument that names another place."""
    fix = _FIXES.get(error.errno or 0, _ELSEWHERE)
    return tuple(by if part is OUT else part for part in fix) if isinstance(fix, tuple) else fix


def fix_to_read(error: OSError) -> Phrase:
    """Advice where something could not be read."""
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
