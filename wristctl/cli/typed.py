"""A line that a person types, while other things go on."""

from __future__ import annotations

import io
import os
import select
import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wristctl.trial.patience import Meanwhile

_MOMENT = 0.02


def typed_line(meanwhile: Meanwhile) -> str:
    """The next line of stdin, its end cut off; empty where stdin has ended.

    `meanwhile` is called until the line is there, and may raise: reading never waits, not even for half a line.
    """
    try:
        stdin = sys.stdin.fileno()
    except (io.UnsupportedOperation, ValueError):  # no file of the system: what is in it has come already
        return sys.stdin.readline().rstrip("\r\n")
    typed = bytearray()
    while not typed.endswith(b"\n"):
        if not select.select([stdin], [], [], 0.0)[0]:
            meanwhile()
        elif byte := os.read(stdin, 1):
            typed += byte
        else:
            break
    return typed.decode(errors="replace").rstrip("\r\n")


def idle() -> None:
    """A moment in which nothing else goes on."""
    time.sleep(_MOMENT)
