"""How far back a loop behind a camera remembers."""

from __future__ import annotations

import math

import pytest

from tests.stability.conftest import CAMERA
from wristctl.config.loop import Loop
from wristctl.stability.loop_ticks import looks_back


@pytest.mark.parametrize("delay", [0.5, 1.5, 2.5, 4.25])
def test_frames_under_way_are_the_most_at_any_tick_and_motors_are_remembered_since_the_last_that_came(
    delay: float,
) -> None:
    """Four ticks from one frame to the next; just before a frame comes, the newest is as old as its delay and that."""
    loop = Loop(control_period=5e-3, sensor=CAMERA.model_copy(update={"frame_rate": 50.0, "delay_frames": delay}))
    early, remembered = looks_back(loop)
    assert remembered.frames == math.ceil(delay) and remembered.ticks == 4 * delay + 4
    assert early % 4 == 0 and early > 4 * delay, "from a time on at which frames arrive"


def test_a_loop_without_a_camera_remembers_nothing() -> None:
    assert looks_back(Loop()) == (0, (0, 0))
