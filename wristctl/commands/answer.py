"""The answer of a study for one screen: a sentence, a table, what follows from it, and where more is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from wristctl.commands.printed_table import COLUMNS, Table, in_lines

# Lines of a terminal that an answer may take, and digits of its numbers.
LINES, _DIGITS = 32, 3


@dataclass(frozen=True)
class Answer:
    """What a study found, in the order in which a person reads it. Angles are in degrees."""

    sentence: str
    """The answer in one or two plain sentences."""
    table: Table | None = None
    """Figures behind the sentence, with units in the heads: at most COLUMNS wide."""
    notes: Sequence[str | Table] = ()
    """What not to use and why, and what to do next: a paragraph or a table each; after `$ ` a command."""
    more: str = ""
    """Where more is."""

    def lines(self) -> list[str]:
        """The answer in lines of at most COLUMNS columns; a table and each paragraph stand apart by an empty line."""
        blocks = [in_lines(self.sentence)]
        if self.table is not None:
            blocks.append(self.table.text(COLUMNS, _DIGITS).split("\n"))
        blocks += [_lines(note) for note in self.notes]
        blocks += [in_lines(self.more)] * bool(self.more)
        return [line for k, block in enumerate(blocks) for line in [*[""] * bool(k), *block]]

    @property
    def fits(self) -> bool:
        """Whether it fits one screen."""
        return len(self.lines()) <= LINES

    def fitted(self, notes: Sequence[str | Table]) -> Answer:
        """The answer with those of these notes for which a screen has room, the first ones first."""
        kept: list[str | Table] = []
        for note in notes:
            if note and replace(self, notes=[*kept, note]).fits:
                kept.append(note)
        return replace(self, notes=kept)

    def ending(self, sentences: Sequence[str]) -> Answer:
        """The answer with these sentences last: a paragraph each, else in one as many as a screen has room for."""
        apart = replace(self, notes=[*self.notes, *sentences])
        if apart.fits:
            return apart
        counts = range(len(sentences), 0, -1)
        together = (replace(self, notes=[*self.notes, " ".join(sentences[:count])]) for count in counts)
        return next((answer for answer in together if answer.fits), self)

    def __str__(self) -> str:
        return "\n".join(self.lines())


def rest(what: str, run: str) -> str:
    """Where the rest of an answer is, and `what` that is; `run` is the run's path, empty for a result in memory."""
    return f"{what}: {'`--all`, or report.html of the run' if run else '`.tables` and `.figures`'}."


def _lines(note: str | Table) -> list[str]:
    if isinstance(note, Table):
        return note.text(COLUMNS, _DIGITS).split("\n")
    return [note[2:]] if note.startswith("$ ") else in_lines(note)
