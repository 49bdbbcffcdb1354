"""Motors are stopped gently first, hard if they do not stand, and a board that does not answer is told of."""

from __future__ import annotations

from typing import Any

import pytest

from tests.trial.conftest import settings_of
from tests.trial.rig import RigBoard
from wristctl.board.board_errors import BoardError
from wristctl.board.messages import Command, Configure, Fault, Flag, Limits, State
from wristctl.config.plant import Actuator
from wristctl.trial.motors_ready import after_a_fault, halt, prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of


class Moving(RigBoard):
    """Stands so many seconds after a command that it heeds; refuses or fails where a test says so."""

    def __init__(self, heeds: Command | None, after: float = 0.1, failing: tuple[Command, ...] = ()) -> None:
        super().__init__()
        self.heeds, self.after, self.failing, self.stands = heeds, after, failing, float("inf")
        self.dead = False

    def send(self, message: Any) -> None:
        self.told.append(message)
        if message in self.failing or self.dead:
            raise BoardError("host", f"{message.name} fails")
        if message is self.heeds:
            self.stands = self.transport.now() + self.after

    def read(self) -> Any:
        if self.dead:
            raise BoardError("cable", "nothing answers")
        self.flags = Flag.MOVING if self.transport.now() < self.stands else Flag(0)
        return super().read()


def halted(board: Any) -> Any:
    return halt(board, 0.1)


def test_a_board_that_ramps_down_is_seen_to_stand() -> None:
    board = Moving(Command.STOP)
    done = halted(board)
    assert done.verified and done.how == "STOP, board ENABLED" and board.told == [Command.STOP]
    assert done.seconds == pytest.approx(0.1, abs=0.006) and done.status.state is State.ENABLED


def test_one_that_does_not_stand_within_half_a_second_is_stopped_hard() -> None:
    board = Moving(Command.ESTOP, after=0.0)
    done = halted(board)
    assert done.verified and done.how == "ESTOP, board ENABLED" and board.told == [Command.STOP, Command.ESTOP]
    assert done.seconds == pytest.approx(0.5, abs=0.01)


def test_one_that_refuses_but_stands_is_stopped() -> None:
    """In a fault it has stopped already: its status is what counts."""
    board = Moving(None, failing=(Command.STOP,))
    board.stands, board.state = 0.0, State.FAULT
    done = halted(board)
    assert done.verified and done.how == "STOP, board FAULT" and board.told == [Command.STOP]


def test_one_that_goes_on_moving_is_left_to_its_watchdog() -> None:
    done = halted(Moving(None))
    assert not done.verified and done.status is None
    assert done.how.startswith("still moving; the board stops by itself 100 ms after")
    assert done.seconds == pytest.approx(0.5, abs=0.02)


def test_one_that_does_not_answer_is_told_of_by_its_last_error() -> None:
    board = Moving(None)
    board.dead = True
    done = halted(board)
    assert not done.verified and "nothing answers" in done.how and board.told == [Command.STOP, Command.ESTOP]


def test_before_anything_moves_ramps_watchdog_and_limits_are_set_and_drives_switched_on() -> None:
    board: Any = RigBoard()
    actuator = Actuator(level="tendon", pulley_radius=6e-3, ramp=150_000.0)
    settings = settings_of(actuator=actuator, safety={"watchdog": 0.2, "travel": 0.01, "hold": True})
    prepare(board, settings)
    prepare(board, settings, 1e-3)
    steps, homing, one = (round(length / spools_of(actuator).step) for length in (0.01, 2.78e-3, 1e-3))
    limits = (-steps,) * 4, (steps,) * 4
    ramps = Configure(0.2, 1, 150_000)
    assert board.told == [ramps, Limits(*limits, homing), "enable", ramps, Limits(*limits, one), "enable"]


def test_an_old_fault_is_cleared_first() -> None:
    board: Any = RigBoard()
    assert prepare(board, settings_of()) == "" and "clear" not in board.told
    board.told.clear()
    board.state, board.faults = State.FAULT, Fault.ESTOP_COMMAND | Fault.LINK
    assert prepare(board, settings_of()) == "LINK and ESTOP_COMMAND"
    assert board.told[0] == "clear" and board.told[1].hold_on_fault == 0 and board.told[-1] == "enable"


@pytest.mark.parametrize("cleared", ["", "ESTOP_COMMAND"])
def test_a_homing_that_stops_after_a_fault_says_that_the_drives_had_let_go(cleared: str) -> None:
    """Anything else that ends it stays as it is."""
    why, fix = "tendon 1 pulls differently each time", "see whether it slips"
    with pytest.raises(SafetyStop) as stop, after_a_fault(cleared):
        raise SafetyStop(why, "homing", fix)
    said, advice = str(stop.value.what), str(stop.value.fix)
    assert said.startswith(f"stopped: {why}") and said.count("stopped") == 1 and stop.value.where == "homing"
    assert ("let go in a fault before (ESTOP_COMMAND)" in said) is ("hw tension" in advice) is bool(cleared)
    with pytest.raises(BoardError, match="cable"), after_a_fault(cleared):
        raise BoardError("cable", "cable")
