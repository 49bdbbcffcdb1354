"""A bend across the plane, against sums over the mass of the bent wrist."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.segments import segments

WRIST = WristParameters(gravity=(-9.0, 2.0), mass=0.4, hand_mass=0.3)
AWAY = (-1, 1, -1, 1)


def places(bend: float) -> tuple[np.ndarray, np.ndarray]:
    """Points along a constant curvature, and the hand beyond its end, x + iy."""
    angle = bend * (np.arange(20_000) + 0.5) / 20_000
    wrist = np.cumsum(np.exp(1j * angle)) * WRIST.length / 20_000
    return wrist, wrist[-1:] + WRIST.hand_offset * np.exp(1j * bend)


def energy(bend: float) -> float:
    """Of springs and gravity, point by point."""
    wrist, hand = places(bend)
    weight = complex(*WRIST.gravity).conjugate()
    lifted = (weight * (WRIST.mass * wrist.mean() + WRIST.hand_mass * hand[0])).real
    return float(0.5 * WRIST.stiffness * bend**2 - lifted)


def test_stiffness_and_moment_are_the_derivatives_of_the_energy() -> None:
    found, h = across_of(WRIST, AWAY), 1e-3
    assert found.moment == pytest.approx(-(energy(h) - energy(-h)) / (2 * h), rel=1e-3)
    assert found.stiffness == pytest.approx((energy(h) - 2.0 * energy(0.0) + energy(-h)) / h**2, rel=1e-3)
    assert found.damping == WRIST.damping


def test_its_inertia_is_what_its_points_masses_resist_with_where_it_is_straight() -> None:
    h = 1e-4
    moved = [(one - other) / (2.0 * h) for one, other in zip(places(h), places(-h), strict=True)]
    masses = [WRIST.mass / 20_000, WRIST.hand_mass]
    inertia = sum(mass * (np.abs(speed) ** 2).sum() for mass, speed in zip(masses, moved, strict=True))
    assert across_of(WRIST, AWAY).inertia == pytest.approx(inertia, rel=1e-3)
    zero = np.zeros(1)
    of_the_plane = terms(segments(WristParameters(), 1), zero, zero).mass[0, 0]
    assert across_of(WristParameters(), AWAY).inertia == pytest.approx(of_the_plane, rel=2e-3)


def test_tendons_pull_to_their_sides_and_gravity_goes_with_the_side_of_tendon_5() -> None:
    found, seen_from_behind = across_of(WRIST, AWAY), across_of(WRIST, [-each for each in AWAY])
    assert found.levers == pytest.approx(WRIST.tendon_offset * np.array(AWAY))
    assert seen_from_behind.moment == -found.moment and seen_from_behind.stiffness == found.stiffness
