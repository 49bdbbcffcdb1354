"""What is told of a step response is what python-control tells, and what closed forms say."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from tests.stability.conftest import closed, linear
from wristctl.config.loop import Loop
from wristctl.stability.loop_analysis import step_info, step_response
from wristctl.stability.sampled_loop import LinearTick, SampledLoop

S, PERIOD = control.tf("s"), 1e-3


def _followed(of: control.TransferFunction, ticks: int = 1) -> SampledLoop:
    """A loop whose angle follows its reference like this, in a cycle of so many ticks that are all alike."""
    own = control.ss(control.c2d(control.ss(of), PERIOD / ticks))
    into, back = np.array(own.B)[:, 0], np.array(own.C)[0]
    tick = LinearTick(np.array(own.A), 0.0 * into, 0.0 * back, into, True, {"theta": back})
    return SampledLoop(PERIOD / ticks, [tick] * ticks)


@pytest.mark.parametrize("damping", [0.2, 0.7, 1.5])
def test_rise_overshoot_and_settling_are_python_controls(damping: float) -> None:
    own = 900.0 / (S * S + 2.0 * damping * 30.0 * S + 900.0)
    found = step_response(_followed(own))
    told = control.step_info(found.angle, T=found.time, yfinal=found.final)
    assert (found.rise, found.settling) == pytest.approx((told["RiseTime"], told["SettlingTime"]), abs=1.5 * PERIOD)
    assert found.overshoot == pytest.approx(told["Overshoot"] / 100.0, abs=1e-6)
    if damping < 1.0:
        assert found.overshoot == pytest.approx(math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), rel=2e-3)
    assert found.final == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("ticks", [1, 3])
def test_a_short_response_has_every_tick_of_its_cycles(ticks: int) -> None:
    quick = step_response(_followed(1.0 / (0.1 * S + 1), ticks))
    np.testing.assert_allclose(np.diff(quick.time), PERIOD / ticks, rtol=1e-9)
    np.testing.assert_allclose(quick.angle, -np.expm1(-quick.time / 0.1), atol=1e-9)
    assert quick.time[-1] >= 0.1 * math.log(1e5) and quick.rise == pytest.approx(0.1 * math.log(9.0), abs=PERIOD)


@pytest.mark.parametrize(("ticks", "lag", "stride"), [(1, 10.0, 3), (2, 10.0, 3), (2, 4.0, 2), (1, 2.0, 1)])
def test_a_long_response_is_sampled_every_so_many_ticks_and_is_the_same(ticks: int, lag: float, stride: int) -> None:
    slow = step_response(_followed(1.0 / (lag * S + 1), ticks))
    assert len(slow.time) < 40_000 and slow.time[-1] > min(50.0, lag * math.log(1e5))
    np.testing.assert_allclose(np.diff(slow.time), stride * PERIOD, rtol=1e-6)
    np.testing.assert_allclose(slow.angle, -np.expm1(-slow.time / lag), atol=1e-6)
    assert slow.rise == pytest.approx(lag * math.log(9.0), rel=1e-2) and slow.overshoot == 0.0


@pytest.mark.parametrize("slow", [0.0, 1e-4, 0.02])
def test_what_hardly_decays_is_not_waited_for(slow: float) -> None:
    """A fast lag of 40 1/s beside a leak that nothing drives: it has settled to 1e-5 long before that has."""
    transition, into = np.diag(np.exp(-PERIOD * np.array([40.0, slow]))), np.array([-math.expm1(-40.0 * PERIOD), 0.0])
    tick = LinearTick(transition, into, np.zeros(2), into, True, {"theta": np.array([1.0, 1.0])})
    found = step_response(SampledLoop(PERIOD, [tick]))
    assert found.time[-1] == pytest.approx(math.log(1e5) / 40.0, abs=2.0 * PERIOD)
    np.testing.assert_allclose(found.angle, -np.expm1(-40.0 * found.time), atol=1e-9)
    assert found.rise == pytest.approx(math.log(9.0) / 40.0, abs=1.5 * PERIOD)
    waited = SampledLoop(PERIOD, [tick._replace(transition=np.diag(np.exp(-PERIOD * np.array([40.0, 0.23]))))])
    lasts = math.log(1e5) / 0.23
    assert lasts <= step_response(waited).time[-1] < lasts + 0.01


def test_of_an_unstable_loop_there_is_no_step() -> None:
    found = step_response(closed(np.array([[1.5]]), np.array([0.1]), np.array([1.0]), PERIOD))
    assert len(found.time) == 0 and all(map(math.isnan, (found.rise, found.overshoot, found.settling, found.final)))


def test_where_it_arrives_is_told_of_a_loop_with_a_steady_error() -> None:
    weak = {"P1": 1.0, "P2": 1.0, "P3": 1.0}
    found = step_response(linear("smc", weak, Loop(), 10.0).closed)
    assert 0.3 < found.final < 0.99 and found.angle[-1] == found.final


def test_info_counts_from_where_it_ends_downward_too() -> None:
    time = np.arange(6.0)
    assert step_info(time, -np.array([0.0, 0.05, 0.5, 1.2, 1.01, 1.0])) == pytest.approx((1.0, 0.2, 4.0, -1.0))
