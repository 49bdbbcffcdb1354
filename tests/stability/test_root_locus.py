"""Where poles go, and the values between which a loop is stable."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.stability.conftest import PID, closed, row
from wristctl.config.loop import Loop
from wristctl.stability.loop_analysis import root_locus
from wristctl.stability.margins import margins
from wristctl.stability.sampled_loop import SampledLoop

THETA = math.radians(10.0)


def test_poles_of_an_integrator_go_along_the_axis_and_its_limit_is_known() -> None:
    """z = 1 - k: stable up to twice the deadbeat gain, where it turns with every sample."""

    def at(factor: float) -> SampledLoop:
        return closed(np.eye(1), np.array([0.5 * factor]), np.array([1.0]), 0.1)

    found = root_locus("k", at, 100.0)
    for factor, poles in zip(found.factors, found.poles, strict=True):
        z = 1.0 - 0.5 * factor
        if abs(z) > 1e-4:
            assert poles[0] == pytest.approx((math.log(abs(z)) / 0.1, 0.0 if z > 0.0 else 5.0), abs=1e-9)
    assert found.most == pytest.approx(4.0, rel=1e-3) and found.swings[1] == pytest.approx(5.0)
    assert found.least == 0.0 and math.isnan(found.swings[0])


def test_a_loop_that_needs_some_gain_has_a_lower_limit() -> None:
    """z = 1.2 - k of an unstable plant: stable from k = 0.2, where it runs away, to 2.2."""

    def at(factor: float) -> SampledLoop:
        return closed(np.array([[1.2]]), np.array([factor]), np.array([1.0]), 0.1)

    found = root_locus("k", at, 10.0)
    assert (found.least, found.most) == pytest.approx((0.2, 2.2), rel=1e-3) and found.swings[0] == 0.0


def test_over_the_loops_gain_the_limits_are_the_margins() -> None:
    own = row("pid", PID, Loop())
    found, linear = own.locus(THETA, "loop", 10.0), own.linear(THETA)
    assert linear is not None
    limits = margins(linear.closed)
    assert found.most == pytest.approx(limits.most.value, rel=2e-3) and found.least == 0.0
    assert found.swings[1] == pytest.approx(limits.most.omega / (2.0 * math.pi), rel=1e-6)


@pytest.mark.slow
def test_over_one_gain_the_others_stay() -> None:
    """A derivative gain that is too large is unstable where the whole loop's is: it decides at high frequencies."""
    own = row("pid", PID, Loop())
    derivative, whole = own.locus(THETA, "Kd", 10.0), own.locus(THETA, "loop", 10.0)
    assert derivative.most == pytest.approx(whole.most, rel=0.05)
    assert math.isinf(own.locus(THETA, "Kp", 10.0).most)
    middle = len(derivative.factors) // 2
    assert derivative.factors[middle] == pytest.approx(1.0)
    np.testing.assert_allclose(derivative.poles[middle], whole.poles[middle], rtol=1e-6, atol=1e-6)


def test_a_loop_that_is_unstable_as_it_is_has_no_limits() -> None:
    found = row("pid", "printed", Loop()).locus(THETA, "loop", 10.0)
    assert math.isnan(found.least) and math.isnan(found.most)
