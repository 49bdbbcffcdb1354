"""Every limit that stops at once does so alone, just beyond it, and nothing stops within them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.board.messages import State
from wristctl.control.response import Estimate
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.watch import Tick, Watch

SETTINGS = settings_of(safety={"tension": 58.0})
SPOOLS, PERIOD = spools_of(SETTINGS.actuator), SETTINGS.control_period
WELL = Tick(0.0, 0.001, Estimate(0.5, 1.0, 0.1), np.full(4, 7.0), np.zeros(4), State.ENABLED, 0, 0)


def watching() -> Watch:
    return Watch(SETTINGS, WRIST, "ulnar", TickTiming(PERIOD))


WATCH = watching()


def judge(watch: Watch, age: float = 0.04, **changes: Any) -> None:
    """A tick that is well but for these."""
    tick = WELL._replace(**changes)
    watch.see(tick, tick.clock - age)
    watch.judge(tick)


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
    judge(WATCH, **change(side * (limit - 0.1)))
    with pytest.raises(SafetyStop) as stopped:
        judge(WATCH, **change(side * (limit + 0.1)))
    assert said.format(side * (limit + 0.1)) in stopped.value.what and stopped.value.exit_code == 5


@pytest.mark.parametrize("axis", range(4))
def test_any_tendon_that_pulls_too_hard_stops_and_none_that_is_slack(axis: int) -> None:
    judge(WATCH, **pulled(57.9, axis))
    with pytest.raises(SafetyStop, match="tension of about 59 N beyond 58 N"):
        judge(WATCH, **pulled(59.0, axis))
    judge(WATCH, **pulled(-59.0, axis))
    judge(WATCH, position=sum(pulled(-59.0, each)["position"] for each in range(4)))


@pytest.mark.parametrize("side", BOTH_SIDES)
def test_a_standing_wrist_is_judged_by_its_angle_and_its_tendons(side: float) -> None:
    still = np.zeros(4)
    WATCH.standing(np.array([side * math.radians(54.9)]), still, still, 0.0)
    with pytest.raises(SafetyStop, match=f"angle {side * 55.1:.1f} deg"):
        WATCH.standing(np.array([side * math.radians(55.1)]), still, still, 0.0)
    with pytest.raises(SafetyStop, match="tension of about 59 N"):
        WATCH.standing(np.array([0.5 * side]), **pulled(59.0, 3), taut=still, clock=0.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        *(({"estimate": WELL.estimate._replace(**{name: value})}, "not a number")
          for name in Estimate._fields for value in (math.nan, math.inf, -math.inf)),
        ({"age": 0.151}, "no usable marker angle for 151 ms (no picture has come)"),
        *(({"state": state}, f"the board is {state.name}") for state in State if state != State.ENABLED),
        ({"late": 0.051}, "51 ms late"),
        ({"late": 2.0, "age": 2.1, "state": State.FAULT}, "2000 ms late"),
    ],
)  # fmt: skip
def test_what_is_late_lost_or_no_number_stops(change: dict[str, Any], said: str) -> None:
    with pytest.raises(SafetyStop) as stopped:
        judge(WATCH, **change)
    assert said in stopped.value.what and stopped.value.exit_code == 5 and stopped.value.fix


def test_what_is_nearly_too_late_goes_on() -> None:
    judge(WATCH, age=0.149, late=0.049)


def lapsing(lapses: Sequence[int], times: Sequence[float]) -> None:
    watch = watching()
    for count, time in zip(lapses, times, strict=True):
        judge(watch, lapses=count, clock=time)


def test_the_third_lapsed_rate_within_a_second_stops() -> None:
    """Counted from what the board had counted before, and over its count's end."""
    lapsing((7, 8, 8, 9, 9), (0.0, 0.1, 0.3, 0.6, 0.9))
    lapsing((254, 255, 0, 1), (0.0, 0.1, 0.8, 1.11))
    for lapses, times in (((254, 255, 0, 1), (0.0, 0.1, 0.8, 1.09)), ((7, 10), (0.0, 0.1))):
        with pytest.raises(SafetyStop, match="step rates came too late to the board 3 times in 1 s"):
            lapsing(lapses, times)
