"""Motors moved by a person's word, on an emulated board."""

from __future__ import annotations

from wristctl.board.driver import Board
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.messages import Fault
from wristctl.config.hw_run import CalibrateWristSettings
from wristctl.trial.by_hand import ByHand


class SlowWire(VirtualTransport):
    """Answers come 14 ms after their commands."""

    def read(self, timeout: float) -> bytes:
        self.wait(0.014)
        return super().read(timeout)


def test_targets_that_are_refused_one_after_another_let_no_watchdog_lapse() -> None:
    """The board's watchdog takes 100 ms, and a refused command does not feed it: eight of them take 112 ms here."""
    settings = CalibrateWristSettings()
    with Board(SlowWire()) as board:
        hand = ByHand(board, settings)
        hand.home()
        assert hand.limits_hold() == round(settings.safety.travel / settings.actuator.step_length)
        assert board.read().faults == Fault(0)
