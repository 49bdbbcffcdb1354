"""A bend across the plane, against sums over the mass of the bent wrist."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.wrist.across import across_of

WRIST = WristParameters(gravity=(-9.0, 2.0), mass=0.4, hand_mass=0.3)
AWAY = (-1, 1, -1, 1)


def energy(bend: float) -> float:
    """Of springs and gravity, point by point along a constant curvature."""
    s = (np.arange(20_000) + 0.5) / 20_000 * WRIST.length
    angle = bend * s / WRIST.length
    step = WRIST.length / 20_000
    x, y = np.cumsum(np.cos(angle)) * step, np.cumsum(np.sin(angle)) * step
    hand = x[-1] + WRIST.hand_offset * np.cos(bend), y[-1] + WRIST.hand_offset * np.sin(bend)
    along, aside = WRIST.gravity
    lifted = WRIST.mass * (along * x.mean() + aside * y.mean()) + WRIST.hand_mass * (along * hand[0] + aside * hand[1])
    return float(0.5 * WRIST.stiffness * bend**2 - lifted)


def test_stiffness_and_moment_are_the_derivatives_of_the_energy() -> None:
    found, h = across_of(WRIST, AWAY), 1e-3
    assert found.moment == pytest.approx(-(energy(h) - energy(-h)) / (2 * h), rel=1e-3)
    assert found.stiffness == pytest.approx((energy(h) - 2.0 * energy(0.0) + energy(-h)) / h**2, rel=1e-3)
    assert found.damping == WRIST.damping


def test_tendons_pull_to_their_sides_and_gravity_goes_with_the_side_of_tendon_5() -> None:
    found, seen_from_behind = across_of(WRIST, AWAY), across_of(WRIST, [-each for each in AWAY])
    assert found.levers == pytest.approx(WRIST.tendon_offset * np.array(AWAY))
    assert seen_from_behind.moment == -found.moment and seen_from_behind.stiffness == found.stiffness
