"""For tests against the wall clock on a computer that has more to do: what is awaited are conditions, not times."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from wristctl.board.board_errors import NoAnswer
from wristctl.board.driver import Board
from wristctl.board.messages import Configure
from wristctl.board.transport import Transport

WATCHDOG = 1.0
"""Seconds of silence that a patient host's board bears: more than a busy computer is silent for by itself."""


def wait_for(what: Callable[[], Any], patience: float = 60.0) -> Any:
    """What it gives once that is true."""
    until = time.monotonic() + patience
    while not (got := what()):
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.02)
    return got


def patient(transport: Transport) -> Board:
    """A connected board whose watchdog bears WATCHDOG of silence; its driver waits nearly as long for an answer."""
    board = Board(transport)
    board.connect()

    def configured() -> bool:
        try:
            board.set_up(Configure(watchdog=WATCHDOG))
        except NoAnswer:
            return False
        return True

    wait_for(configured)
    return board
