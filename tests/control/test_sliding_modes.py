"""What the two tracking sliding modes promise: the reaching law, finite time, a continuous torque."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.conftest import ClosedLoop, Sine
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of

WRIST = WristParameters()
SOFT = WRIST.model_copy(update={"stiffness": 0.8 * WRIST.stiffness})


def test_sigma_follows_its_reaching_law_from_a_step(closed_loop: ClosedLoop) -> None:
    """sigma' = -k phi tanh(sigma/phi), so sinh(sigma/phi) falls as exp(-k t)."""
    slope, restoring, k, phi, period = 40.0, 100.0, 20.0, 5.0, 1e-5
    reference = np.tile([0.3, 0.0, 0.0], (20_000, 1))
    course = closed_loop("smc-tracking", (slope, restoring, k, phi), reference, WRIST, WRIST, period=period)
    error, time = course.theta - 0.3, np.arange(20_000) * period
    sigma = course.rate + slope * error + restoring * (np.cumsum(error) * period)
    expected = phi * np.arcsinh(np.sinh(sigma[0] / phi) * np.exp(-k * time))
    assert np.abs(sigma - expected).max() < 2e-3 * abs(sigma[0])


def test_a_moving_reference_leaves_no_lag_where_the_printed_law_has_one(closed_loop: ClosedLoop, sine: Sine) -> None:
    reference = sine(0.5, 0.5, 4.0, 1e-4)
    ours, printed = (
        closed_loop(name, gains, reference, WRIST, WRIST, period=1e-4)
        for name, gains in (("smc-tracking", (50.0, 1.0, 20.0, 100.0)), ("smc", (50.0, 1.0, 20.0)))
    )
    rms = [np.sqrt(np.mean((c.theta - reference[:, 0]) ** 2)) for c in (ours, printed)]
    assert rms[0] < 1e-5 < 1e-3 < rms[1]


def test_super_twisting_reaches_its_surface_in_finite_time_despite_a_wrong_model(
    closed_loop: ClosedLoop, sine: Sine
) -> None:
    """The soft wrist's missing torque over M changes by at most 80 rad/s^3: below k2, so s reaches 0 and stays."""
    period, slope, tau = 1e-5, 20.0, 1e-4
    reference = sine(0.5, 0.5, 1.5, period)
    reference[:, 0] += 0.02
    course = closed_loop("super-twisting", (slope, 30.0, 400.0, tau), reference, SOFT, WRIST, period=period)
    s = course.rate - reference[:, 1] + slope * (course.theta - reference[:, 0])
    reached = int(np.argmax(np.abs(s) < 1e-5))
    assert 0 < reached * period < 0.1
    assert np.abs(s[reached + round(0.1 / period) :]).max() < 1e-5
    assert np.abs(course.theta - reference[:, 0])[-1] < 1e-6


def test_super_twisting_torque_is_continuous_across_its_surface(closed_loop: ClosedLoop, sine: Sine) -> None:
    """Halving the period halves the largest change of torque between ticks; a switching term would leave it."""
    largest = []
    for period in (4e-5, 2e-5, 1e-5):
        reference = sine(0.5, 0.5, 0.6, period)
        course = closed_loop("super-twisting", (20.0, 30.0, 400.0, 1e-3), reference, SOFT, WRIST, period=period)
        s = course.rate - reference[:, 1] + 20.0 * (course.theta - reference[:, 0])
        assert (np.diff(np.sign(s)) != 0).any()
        largest.append(np.abs(np.diff(course.torque)).max())
    assert largest[1] < 0.6 * largest[0] and largest[2] < 0.6 * largest[1]


@pytest.mark.parametrize("name", ["smc-tracking", "super-twisting"])
def test_integral_holds_while_a_tendon_saturates(name: str, closed_loop: ClosedLoop) -> None:
    far = np.tile([0.8, 0.0, 0.0], (50, 1))
    course = closed_loop(name, gains_of(controller(name), "default"), far, WRIST, WRIST, limit=10.0)
    assert (course.memory == 0.0).all()
