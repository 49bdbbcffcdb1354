"""What a board is told before anything moves."""

from __future__ import annotations

from wristctl.board.driver import Board
from wristctl.board.messages import Configure, Limits, State
from wristctl.config.hw_run import RigSettings
from wristctl.trial.spools import spools_of


def prepare(board: Board, settings: RigSettings) -> None:
    """Set ramps, watchdog and soft limits of a board, clear an old fault, and switch the drives on."""
    limits, spools = settings.safety, spools_of(settings.actuator)
    if board.read().state == State.FAULT:
        board.clear()
    furthest = round(limits.travel / spools.step)
    ramps = Configure(limits.watchdog, int(limits.hold), round(spools.acceleration))
    board.set_up(ramps, Limits((-furthest,) * 4, (furthest,) * 4))
    board.enable()
