"""Motors moved by a person's word, on an emulated board."""

from __future__ import annotations

from typing import Any

import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.messages import Fault
from wristctl.config.hw_run import CalibrateWristSettings, HwRunSettings
from wristctl.errors import UserError
from wristctl.trial.by_hand import ByHand, bent_by_tendon, take_up
from wristctl.trial.homing import find_zero
from wristctl.trial.motors_ready import prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.vision.view import View

QUICK = {"move": 1e-4, "rest": 0.15, "frames": 2, "slack": 8e-4, "let_go": 1.0}


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


def ready(**motors: Any) -> tuple[VirtualBench, Board, HwRunSettings]:
    settings = settings_of(homing=QUICK, bench={"motors": motors, "camera": {"frame_rate": 30.0}})
    bench = VirtualBench(settings.bench, WRIST, 0)
    board = Board(bench.transport)
    board.connect()
    return bench, board, settings


@pytest.mark.parametrize(("axis", "sense"), [(0, 1), (3, -1)])
def test_slack_beyond_the_reach_is_taken_up_in_several_goes_between_which_the_drives_let_go(
    axis: int, sense: int
) -> None:
    """Nobody says taut before 5 mm; 60 N at 20 kN/m are 3 mm."""
    bench, board, settings = ready(slack=(0.02,) * 4)
    asked, on = list[float](), list[tuple[bool, ...]]()

    def taut(reeled: float) -> bool:
        asked.append(reeled)
        on.append(tuple(bench.motion().energised))
        return reeled > 4.9e-3

    signs = [sense if k == axis else 1 for k in range(4)]
    found = take_up(board, settings, signs, axis, 1e-3, taut)
    assert asked == pytest.approx([1e-3, 2e-3, 3e-3, 4e-3, 5e-3]) and found == pytest.approx(5e-3)
    assert on == [(True,) * 4] * 5 and not any(bench.motion().energised)
    step = settings.actuator.step_length
    let_go = round(settings.homing.pull / step)
    assert board.read().position[axis] == sense * (5 * round(1e-3 / step) - let_go)
    assert len({each for k, each in enumerate(bench.motion().steps) if k != axis}) == 1


def test_a_tendon_that_is_never_taut_is_told_of_with_the_drives_released() -> None:
    bench, board, settings = ready(slack=(0.02,) * 4)
    with pytest.raises(UserError, match=r"axis 2 has reeled in 20\.0 mm, and its tendon is not taut") as never:
        take_up(board, settings, (1,) * 4, 2, 2.5e-3, lambda reeled: False)
    assert "hw check --wiring 2" in str(never.value.fix) and not any(bench.motion().energised)


@pytest.mark.slow
def test_after_a_stop_homing_says_slack_and_homes_once_the_camera_has_seen_it_taken_up() -> None:
    """Two tendons had been paid out by 3 mm, as those opposite to a bend are, when the stop released the drives."""
    bench, board, settings = ready(slack=(1e-4,) * 4)
    prepare(board, settings, 5e-3)
    board.jog([round(-3e-3 / settings.actuator.step_length) * (k < 2) for k in range(4)])
    board.emergency_stop()
    board.clear()
    tracking = EmulatedTestbed(bench, settings, [View()], None).tracking()
    prepare(board, settings)
    with pytest.raises(SafetyStop, match="its tendon is slack") as slack:
        find_zero(board, tracking, settings, WRIST, "ulnar")
    assert "hw tension --axis 0" in str(slack.value.fix)
    board.disable()
    lengths = []
    for axis in range(4):
        taut = bent_by_tendon(board, tracking, settings, WRIST, "ulnar")
        lengths.append(take_up(board, settings, (1,) * 4, axis, 2e-4, taut))
    assert lengths[:2] == pytest.approx([3.1e-3] * 2, abs=6e-4) and lengths[2:] == pytest.approx([1e-4] * 2, abs=6e-4)
    prepare(board, settings)
    zero = find_zero(board, tracking, settings, WRIST, "ulnar")
    assert zero.signs == (1, 1, 1, 1) and 0.0 < min(zero.slack) <= max(zero.slack) < settings.homing.pull
