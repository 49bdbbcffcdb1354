"""Sentences of an answer in lines that a terminal and a README show alike, and the numbers in them."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wristctl.comparison.shares import Share

COLUMNS = 100
"""What a line of an answer may take."""


def in_lines(text: str, columns: int = COLUMNS, most: int | None = None, indent: str = "") -> list[str]:
    """A text in at most so many lines, broken between words; where some is left out a mark says so."""
    return textwrap.wrap(
        text, columns, subsequent_indent=indent, max_lines=most, placeholder=" ...",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def two(value: float, digits: int = 2) -> str:
    """A number to two digits (or so many), as short as it goes: 15000, 0.012, 3.1e-5."""
    shown = f"{value:.{digits}g}"
    if "e+" in shown and abs(value) < 1e6:
        return f"{float(shown):.0f}"
    mantissa, _, power = shown.partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def degrees(error: float, digits: int = 2) -> str:
    """An error [rad] in degrees, to so many digits; `<0.001` where nobody could measure it."""
    from wristctl.comparison.geometric_means import MEASURABLE

    if error <= MEASURABLE * (1.0 + 1e-9):
        return f"<{math.degrees(MEASURABLE):g}"
    return two(math.degrees(error), digits)


def percent(share: Share) -> str:
    """A share with its 95 % interval: 0.8 % [0.1, 2.9]."""
    value, low, high = (f"{100.0 * each:.2g}" for each in (share.value, share.low, share.high))
    return f"{value} % [{low}, {high}]"
