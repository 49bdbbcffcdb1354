"""Text of unknown origin on a terminal, where control characters would move the cursor or forge lines."""

from __future__ import annotations


def printable(text: object) -> str:
    """The text with what a terminal obeys, or cannot show, written as escapes: one line."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in str(text))
