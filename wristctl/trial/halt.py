"""Stopping the motors, and seeing by the board's status that they stand."""

from __future__ import annotations

from typing import NamedTuple

from wristctl.board.board_errors import BoardError
from wristctl.board.driver import Board
from wristctl.board.messages import Command, Flag, Status

_PATIENCE = 0.5
"""Seconds within which motors at any speed have ramped down."""


class Halt(NamedTuple):
    """How the motors were stopped."""

    verified: bool
    """Whether the board's own status says that nothing moves."""
    how: str
    status: Status | None
    seconds: float
    """From the decision to stop until they stood."""


def halt(board: Board, watchdog: float) -> Halt:
    """Stop the motors, first by a ramp, else by an emergency stop; never raises for a board that does not answer."""
    began = board.transport.now()
    said = []
    for command in (Command.STOP, Command.ESTOP):
        try:
            try:
                board.send(command)
            except BoardError as error:  # in a fault it has stopped already: its status is what counts
                said.append(str(error.what))
            status = _standing(board, began + _PATIENCE)
        except BoardError as error:
            said.append(str(error.what))
            continue
        if status is not None:
            how = f"{command.name}, board {status.state.name}"
            return Halt(True, how, status, board.transport.now() - began)
    why = said[-1] if said else "still moving"
    fallback = f"{why}; the board stops by itself {1e3 * watchdog:.0f} ms after the last command, else cut motor power"
    return Halt(False, fallback, None, board.transport.now() - began)


def _standing(board: Board, deadline: float) -> Status | None:
    """The status once nothing moves, None if it still does at the deadline."""
    while True:
        status = board.read()
        if Flag.MOVING not in status.flags:
            return status
        if board.transport.now() > deadline:
            return None
        board.transport.wait(0.005)
