"""Every limit stops, alone, and nothing stops within them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from wristctl.board.messages import State
from wristctl.config.hw_run import Safety
from wristctl.config.plant import Actuator
from wristctl.control.response import Estimate
from wristctl.trial.safety import Monitor, SafetyStop, Seen
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import Answer

SPOOLS = spools_of(Actuator(level="tendon"))
WELL = Seen(Estimate(0.5, 1.0, 0.1), 0.04, "ok", np.full(4, 7.0), np.zeros(4), State.ENABLED, 0.001, 0, 0.0)
MONITOR = Monitor(Safety(), SPOOLS)


def test_a_wrist_within_its_limits_goes_on() -> None:
    MONITOR.see(WELL)
    MONITOR.answer(Answer(0.5, 0.5, 10.0, 2.0, False))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"estimate": Estimate(math.radians(55.1), 0.0, 0.0)}, "angle 55.1 deg beyond"),
        ({"estimate": Estimate(-math.radians(55.1), 0.0, 0.0)}, "angle -55.1 deg beyond"),
        ({"estimate": Estimate(0.0, -10.1, 0.0)}, "rate -10.1 rad/s"),
        ({"estimate": Estimate(math.nan, 0.0, 0.0)}, "not a number"),
        ({"age": 0.151, "verdict": "newest frame: no tip"}, "no usable marker angle for 151 ms (newest frame: no tip)"),
        ({"position": np.array([0.0, 0.0, 81.0 / 20e3 / SPOOLS.step, 0.0])}, "tension of about 81 N"),
        ({"position": np.array([0.0, -0.0201 / SPOOLS.step, 0.0, 0.0])}, "a spool 20.1 mm from zero"),
        ({"state": State.DISABLED}, "the board is DISABLED"),
        ({"late": 0.051}, "51 ms late"),
        ({"late": 2.0, "age": 2.1, "state": State.FAULT}, "2000 ms late"),
    ],
)
def test_each_limit_stops_by_itself(change: dict[str, Any], said: str) -> None:
    with pytest.raises(SafetyStop) as stopped:
        MONITOR.see(WELL._replace(**change))
    assert said in stopped.value.what and stopped.value.exit_code == 5


def lapsing(lapses: Sequence[int], times: Sequence[float]) -> Monitor:
    monitor = Monitor(Safety(), SPOOLS)
    for count, time in zip(lapses, times, strict=True):
        monitor.see(WELL._replace(lapses=count, time=time))
    return monitor


def test_the_third_lapsed_rate_within_a_second_stops() -> None:
    """Counted from what the board had counted before, and over its count's end."""
    lapsing((7, 8, 8, 9, 9), (0.0, 0.1, 0.3, 0.6, 0.9))
    lapsing((254, 255, 0, 1), (0.0, 0.1, 0.8, 1.11))
    for lapses, times in (((254, 255, 0, 1), (0.0, 0.1, 0.8, 1.09)), ((7, 10), (0.0, 0.1))):
        with pytest.raises(SafetyStop, match="step rates came too late to the board 3 times in 1 s"):
            lapsing(lapses, times)


def test_a_torque_that_is_no_number_is_never_sent() -> None:
    with pytest.raises(SafetyStop, match="torque is not a number"):
        MONITOR.answer(Answer(math.nan, 0.5, 10.0, 2.0, False))
