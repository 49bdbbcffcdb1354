"""Homing finds what the bench hides: slack, senses of turning, and where the wrist is straight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.homing import Zero, find_zero
from wristctl.trial.motors_ready import prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.tracking import Tracking
from wristctl.trial.zero_checks import HomedWrist
from wristctl.vision.view import View

QUICK = {"move": 1e-4, "rest": 0.15, "frames": 2, "slack": 8e-4, "let_go": 1.0}
SLACK = (3e-4, 2e-4, 4e-4, 2.5e-4)


def settings_with(plant: dict[str, Any] | None = None, **motors: Any) -> HwRunSettings:
    return settings_of(homing=QUICK, bench={"motors": {"slack": SLACK, **motors}, "plant": plant or {}})


def rig_of(settings: HwRunSettings) -> tuple[VirtualBench, Board, Tracking]:
    bench = VirtualBench(settings.bench, WRIST, 0)
    board = Board(bench.transport)
    board.connect()
    prepare(board, settings)
    return bench, board, EmulatedTestbed(bench, settings, [View()], None).tracking()


def homed(signs: tuple[int, ...] | None = None, **motors: Any) -> tuple[Zero, VirtualBench]:
    settings = settings_with(**motors)
    bench, board, tracking = rig_of(settings)
    return find_zero(board, tracking, settings, WRIST, "ulnar", signs), bench


@pytest.mark.slow
def test_slack_senses_and_steps_per_radian_are_found() -> None:
    zero, bench = homed(reversed=(False, True, False, False))
    assert zero.signs == (1, -1, 1, 1)
    assert zero.slack == pytest.approx(SLACK, abs=5e-5)
    step = settings_of().actuator.step_length
    assert zero.steps_per_radian == pytest.approx([2.0 * WRIST.tendon_offset / step] * 4, rel=0.12), "bends askew"
    assert max(zero.friction) < 5e-5
    assert bench.truth(bench.transport.now() - 0.01).reeled[-1] == pytest.approx(np.zeros(4), abs=5e-5)


@pytest.mark.parametrize("friction", [2e-3, 5e-3])
@pytest.mark.slow
def test_friction_inside_the_wrist_turns_no_bend_aside(friction: float) -> None:
    """Let go it stays bent by 0.6 and 1.6 deg, in its plane and across it."""
    settings = settings_with({"inner_friction": friction})
    bench, board, tracking = rig_of(settings)
    zero = find_zero(board, tracking, settings, WRIST, "ulnar")
    assert zero.slack == pytest.approx(SLACK, abs=5e-5 + 2.5e-2 * friction)
    bench.face("flexion")
    tracking.zero = (0.0,)
    HomedWrist(board, tracking, settings, WRIST, "flexion", zero).check_zero()


@pytest.mark.slow
def test_a_tendon_that_is_off_its_pulley_stops_homing() -> None:
    with pytest.raises(SafetyStop, match=r"axis 0 \(tendon 1\) does not bend the wrist within 0.8 mm"):
        homed((1, 1, 1, 1), slack=(5e-3, 2e-4, 4e-4, 2.5e-4))


@pytest.mark.slow
def test_a_rubbing_wrist_on_soft_tendons_is_homed_though_it_takes_more_steps_than_a_sound_one_may() -> None:
    """Of the drawn sound rigs, but for 0.02 N m inside: tendons of 8.7 kN/m in sheaths of 1.6 rad that rub by 0.19."""
    plant = {"inner_friction": 0.02, "creep": 0.04, "stiffness_scale": 0.97}
    actuator = {"tendon_stiffness": 8683.0, "sheath": 1.62, "friction": 0.19}
    settings = settings_of(bench={"motors": {"slack": SLACK}, "plant": plant, "actuator": actuator})
    _, board, tracking = rig_of(settings)
    zero, moves = find_zero(board, tracking, settings, WRIST, "ulnar"), ExpectedMoves(settings, WRIST, "ulnar")
    assert not all(moves.has_steps(0, steps) for steps in zero.steps_per_radian), "a wrist that rubs not is stopped"
