"""Lines on stdout."""

from __future__ import annotations

from wristctl.config.printable import printable


def say(text: object) -> None:
    """Print one line, whatever is in it."""
    print(printable(text))
