"""Whoever stands at the emulated rig, by what is typed: presses the emergency stop, turns the wrist in its clamp."""

from __future__ import annotations

import logging
import os
import select

from wristctl.bench.rig import Rig
from wristctl.wrist.directions import DIRECTIONS

log = logging.getLogger(__name__)

_BUTTON = "G", 0
_ACTS = f"press, release, or one of {', '.join(DIRECTIONS)}"


class Bystander:
    """Does what comes as lines from a file descriptor; never waits for one."""

    def __init__(self, rig: Rig, typed: int) -> None:
        self._rig, self._typed = rig, typed
        self._line = b""
        self._there = True

    def look(self) -> None:
        """Do what has been typed since the last look."""
        while self._there and self._may_read() and select.select([self._typed], [], [], 0.0)[0]:
            read = os.read(self._typed, 256)
            self._there = bool(read)
            *lines, self._line = (self._line + read).split(b"\n")
            for line in lines:
                self.do(line.decode(errors="replace").strip())

    def do(self, act: str) -> None:
        """Press or release the button, or turn the wrist to bend toward a direction."""
        if act in ("press", "release"):
            self._rig.chip.drive(*_BUTTON, act == "press")  # an open contact stops
        elif act in DIRECTIONS:
            self._rig.face(act)
        else:
            log.warning("nobody knows how to %r: %s", act, _ACTS)
            return
        log.info("done: %s", act)

    def _may_read(self) -> bool:
        """In the background a terminal is somebody else's: reading it would stop this process."""
        return not os.isatty(self._typed) or os.tcgetpgrp(self._typed) == os.getpgrp()
