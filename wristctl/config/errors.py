"""Errors that are the user's to mend, as against bugs."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from wristctl.config.wording import Phrase, worded

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
        """What to do about it."""
        return worded(self._fix, self.in_python)

    def at(self, where: Phrase) -> UserError:
        """The same error at a place that is better known."""
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
    """The choice most like `word`, None where none is alike."""
    matches = difflib.get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return matches[0] if matches else None


def meant(word: str, choices: Iterable[str]) -> str:
    """How to fix an unknown `word`: the nearest choice, else all of them, or the first of very many."""
    known = sorted(choices)
    best = nearest(word, known)
    more = f" and {len(known) - _TOLD} more" if len(known) > _TOLD else ""
    return f"did you mean {best!r}?" if best else f"one of {', '.join(known[:_TOLD])}{more}"
