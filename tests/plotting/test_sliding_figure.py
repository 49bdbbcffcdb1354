"""Sigma of a motion: on which side of the layer it is, with which rate, and since when."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from wristctl.commands.simulate.figures import sliding
from wristctl.commands.tune.figures import gain_sensitivity
from wristctl.control.law import Surface
from wristctl.simulation.trajectory import Trajectory

SURFACE = Surface(lambda gains: (gains["a"], gains["b"], 0.0), lambda gains: 0.05)
GAINS = {"a": 2.0, "b": 0.5}


def shares(course: Trajectory, surface: Surface = SURFACE) -> tuple[np.ndarray, np.ndarray]:
    """|sigma| over its layer as drawn, before and after it is in the layer for good."""
    _, over_time = sliding(course, surface, GAINS).axes
    reaching, rest = (np.asarray(line.get_ydata(), float) for line in over_time.lines[:2])
    return reaching, rest


def test_sigma_is_weighted_error_and_rate_and_reached_for_good(course: Callable[..., Trajectory]) -> None:
    """On e' = -e/tau sigma is (a - b/tau) e."""
    one = course("smc/x", 0.5)
    reaching, rest = shares(one)
    sigma = np.abs((2.0 - 0.5 / 0.5) * one.error)
    np.testing.assert_allclose(np.concatenate([reaching[:-1], rest])[1:-1], sigma[1:-1] / 0.05, rtol=0.02, atol=1e-6)
    assert (rest <= 1.0).all() and reaching[-2] > 1.0


def test_the_rate_is_the_errors_unless_the_law_reads_the_angles(course: Callable[..., Trajectory]) -> None:
    one = course("smc/x", 0.5)
    moving = replace(one, theta_ref=one.theta)
    assert max(map(np.max, shares(moving))) <= 1e-6
    own = shares(moving, SURFACE._replace(of_error=False))[0]
    assert own[0] == pytest.approx(0.5 * one.rate[0] / 0.05, rel=1e-6)


def test_a_tornado_puts_the_most_sensitive_gain_on_top_of_what_was_found() -> None:
    (axes,) = gain_sensitivity("pid", ["Kp", "Ki", "Kd"], 1.5, np.array([1.0, 1.1, 0.95, 3.0, 1.0, 1.0, 1.5])).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["Kp", "Kd", "Ki"]
    bars = [(bar.get_x(), bar.get_width()) for bar in axes.patches]  # type: ignore[attr-defined]
    assert bars == [pytest.approx((1.0, each)) for each in (0.1, 0.0, 2.0, -0.05, 0.5, 0.0)]
