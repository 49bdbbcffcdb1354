"""Homing finds what the bench hides: slack, senses of turning, and where the wrist is straight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.trial.homing import Zero, find_zero
from wristctl.trial.motors_ready import prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.vision.view import View

QUICK = {"move": 1e-4, "rest": 0.15, "frames": 2, "slack": 8e-4, "let_go": 1.0}
SLACK = (3e-4, 2e-4, 4e-4, 2.5e-4)


def homed(signs: tuple[int, ...] | None = None, **motors: Any) -> tuple[Zero, VirtualBench]:
    settings = settings_of(homing=QUICK, bench={"motors": {"slack": SLACK, **motors}})
    bench = VirtualBench(settings.bench, WRIST, 0)
    tracking = EmulatedTestbed(bench, settings, [View()], None).tracking()
    board = Board(bench.transport)
    board.connect()
    prepare(board, settings)
    return find_zero(board, tracking, settings, WRIST, "ulnar", signs), bench


def test_slack_senses_and_steps_per_radian_are_found() -> None:
    zero, bench = homed(reversed=(False, True, False, False))
    assert zero.signs == (1, -1, 1, 1)
    assert zero.slack == pytest.approx(SLACK, abs=5e-5)
    step = settings_of().actuator.step_length
    assert zero.steps_per_radian == pytest.approx([2.0 * WRIST.tendon_offset / step] * 4, rel=0.12), "bends askew"
    assert max(zero.friction) < 5e-5
    assert bench.truth(bench.transport.now() - 0.01).reeled[-1] == pytest.approx(np.zeros(4), abs=5e-5)


def test_a_tendon_that_is_off_its_pulley_stops_homing() -> None:
    with pytest.raises(SafetyStop, match=r"axis 0 \(tendon 1\) does not bend the wrist within 0.8 mm"):
        homed((1, 1, 1, 1), slack=(5e-3, 2e-4, 4e-4, 2.5e-4))
