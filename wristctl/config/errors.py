"""Errors that are the user's to mend, as against bugs."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class UserError(Exception):
    """Something the user can mend: what is wrong, where (file, line, key path), how to fix it.

    `exit_code` is 2 for usage and configuration, 3 for a failed check, 4 for hardware, 5 for a safety stop.
    """

    def __init__(self, what: str, where: str = "", fix: str = "", exit_code: int = 2) -> None:
        super().__init__(what, where, fix, exit_code)
        self.what, self.where, self.fix, self.exit_code = what, where, fix, exit_code

    def __str__(self) -> str:
        parts = [self.what, self.where, self.fix and f"fix: {self.fix}"]
        return " ".join(" - ".join(part for part in parts if part).split())


@contextmanager
def under(path: str) -> Iterator[None]:
    """Let an error of the block, which names a key, say that the key stands below this key path."""
    try:
        yield
    except UserError as error:
        where = f"{path}.{error.where}" if error.where else path
        raise UserError(error.what, where, error.fix, error.exit_code) from error


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """The choice most like `word`, None where none is alike."""
    matches = difflib.get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return matches[0] if matches else None


def meant(word: str, choices: Iterable[str]) -> str:
    """How to fix an unknown `word`: the nearest choice, else all of them."""
    known = sorted(choices)
    best = nearest(word, known)
    return f"did you mean {best!r}?" if best else f"one of {', '.join(known)}"
