"""Progress for people."""

from __future__ import annotations

import sys
import time

_BEGAN = time.monotonic()


def say(message: str) -> None:
    """One line on stderr, with the time since the start."""
    print(f"{time.monotonic() - _BEGAN:6.0f} s  {message}", file=sys.stderr, flush=True)
