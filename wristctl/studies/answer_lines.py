"""Sentences of an answer in lines that a terminal and a README show alike."""

from __future__ import annotations

import textwrap

COLUMNS = 100
"""What a line of an answer may take."""


def in_lines(text: str, columns: int = COLUMNS, most: int | None = None, indent: str = "") -> list[str]:
    """A text in at most so many lines, broken between words; where some is left out a mark says so."""
    return textwrap.wrap(
        text, columns, subsequent_indent=indent, max_lines=most, placeholder=" ...",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
