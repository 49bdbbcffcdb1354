"""Every limit stops, alone, and nothing stops within them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
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
ANSWER = Answer(0.5, 0.5, 10.0, 2.0, False)
MONITOR = Monitor(Safety(), SPOOLS)


def test_a_wrist_within_its_limits_goes_on() -> None:
    MONITOR.see(WELL)
    MONITOR.answer(ANSWER)


BOTH_SIDES = [1.0, -1.0]


def bent(theta: float) -> dict[str, Any]:
    return {"estimate": Estimate(math.radians(theta), 0.0, 0.0)}


def turning(rate: float) -> dict[str, Any]:
    return {"estimate": Estimate(0.0, rate, 0.0)}


def reeled(millimetres: float, axis: int) -> dict[str, Any]:
    """One spool reeled in where its tendon is just taut, so that none of it is a pull."""
    along = np.zeros(4)
    along[axis] = 1e-3 * millimetres
    return {"position": along / SPOOLS.step, "taut": along}


def pulled(newtons: float, axis: int) -> dict[str, Any]:
    position = np.zeros(4)
    position[axis] = newtons / SPOOLS.stiffness / SPOOLS.step
    return {"position": position}


@pytest.mark.parametrize("side", BOTH_SIDES)
@pytest.mark.parametrize(
    ("change", "limit", "said"),
    [
        (bent, 55.0, "angle {:.1f} deg beyond +-55 deg"),
        (turning, 10.0, "rate {:.1f} rad/s beyond +-10 rad/s"),
        *((partial(reeled, axis=axis), 20.0, "a spool 20.1 mm from zero, beyond 20 mm") for axis in range(4)),
    ],
)
def test_a_limit_to_both_sides_stops_just_beyond_it_to_either(
    change: Callable[[float], dict[str, Any]], limit: float, said: str, side: float
) -> None:
    MONITOR.see(WELL._replace(**change(side * (limit - 0.1))))
    with pytest.raises(SafetyStop) as stopped:
        MONITOR.see(WELL._replace(**change(side * (limit + 0.1))))
    assert said.format(side * (limit + 0.1)) in stopped.value.what and stopped.value.exit_code == 5


@pytest.mark.parametrize("axis", range(4))
def test_any_tendon_that_pulls_too_hard_stops_and_none_that_is_slack(axis: int) -> None:
    MONITOR.see(WELL._replace(**pulled(79.9, axis)))
    MONITOR.see(WELL._replace(**pulled(-81.0, axis)))
    with pytest.raises(SafetyStop, match="tension of about 81 N beyond 80 N"):
        MONITOR.see(WELL._replace(**pulled(81.0, axis)))


@pytest.mark.parametrize("side", BOTH_SIDES)
def test_a_standing_wrist_is_judged_by_its_angle_and_its_tendons(side: float) -> None:
    still = np.zeros(4)
    MONITOR.standing(side * math.radians(54.9), still, still)
    with pytest.raises(SafetyStop, match=f"angle {side * 55.1:.1f} deg"):
        MONITOR.standing(side * math.radians(55.1), still, still)
    with pytest.raises(SafetyStop, match="tension of about 81 N"):
        MONITOR.standing(0.5 * side, **pulled(81.0, 3), taut=still)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        *(({"estimate": WELL.estimate._replace(**{name: value})}, "not a number")
          for name in Estimate._fields for value in (math.nan, math.inf, -math.inf)),
        ({"age": 0.151, "verdict": "newest frame: no tip"}, "no usable marker angle for 151 ms (newest frame: no tip)"),
        *(({"state": state}, f"the board is {state.name}") for state in State if state != State.ENABLED),
        ({"late": 0.051}, "51 ms late"),
        ({"late": 2.0, "age": 2.1, "state": State.FAULT}, "2000 ms late"),
    ],
)  # fmt: skip
def test_what_is_late_lost_or_no_number_stops(change: dict[str, Any], said: str) -> None:
    with pytest.raises(SafetyStop) as stopped:
        MONITOR.see(WELL._replace(**change))
    assert said in stopped.value.what and stopped.value.exit_code == 5


def test_what_is_nearly_too_late_goes_on() -> None:
    MONITOR.see(WELL._replace(age=0.149, late=0.049))


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


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["torque_wanted", "torque", "plus", "minus"])
def test_what_a_law_wants_is_never_sent_where_it_is_no_number(name: str, value: float) -> None:
    no_number: dict[str, Any] = {name: value}
    with pytest.raises(SafetyStop, match="torque is not a number"):
        MONITOR.answer(ANSWER._replace(**no_number))
