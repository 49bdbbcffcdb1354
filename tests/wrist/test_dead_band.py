"""Roots of the statics with friction, against SciPy's solver and the linear formula of the dead band."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulation.spools import WRIST, rest_angle
from wristctl.config.plant import Actuator
from wristctl.errors import UserError
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import (
    FROM_ABOVE,
    FROM_BELOW,
    UNBENT,
    HeldTendons,
    at_rest_with,
    equilibria_at,
    equilibrium,
    stiffness,
)

SIDE = 2.0 * Actuator().tendon_stiffness
Angles = st.floats(0.02, 0.6) | st.floats(-0.6, -0.02)


def held(angle: np.ndarray, friction: float, sheath: float, n: int = 4) -> tuple[np.ndarray, HeldTendons, np.ndarray]:
    """Wrists on the spools that would hold them at these angles (B,) [rad] without friction."""
    values, count = np.tile(segments(WRIST, n), (len(angle), 1)), len(angle)
    found = equilibria_at(values, n, angle, 2.0 * WRIST.pretension)
    taut = terms(values, found.theta, 0.0 * found.theta).tendon_lengths.sum(axis=1)
    reeled = found.pulls / SIDE + WRIST.length - taut
    tendons = HeldTendons(reeled, np.full((count, 1), SIDE), np.full(count, friction), np.full(count, sheath))
    return values, tendons, found.theta


@pytest.mark.filterwarnings("ignore:The iteration is not making", "ignore:xtol=")  # MINPACK, at the last digits
@settings(deadline=None, max_examples=25)
@given(Angles, st.floats(0.01, 0.3), st.floats(0.0, 4.0), st.sampled_from([FROM_BELOW, FROM_ABOVE]))
def test_rest_is_where_scipy_finds_it(angle: float, friction: float, sheath: float, z: tuple[float, float]) -> None:
    values, tendons, guess = held(np.array([angle]), friction, sheath)
    actuator = Actuator(level="tendon", friction=friction, sheath=sheath)
    plus, minus = tendons.given[0]
    exact = rest_angle((plus, minus), actuator, z, WRIST, 4)
    assert at_rest_with(values, tendons, z, guess).sum() == pytest.approx(exact, abs=1e-9)


def test_without_friction_and_with_unbent_bristles_it_rests_where_it_would() -> None:
    angle = np.linspace(-0.7, 0.7, 7)
    for friction, z in ((0.0, FROM_BELOW), (0.3, UNBENT)):
        values, tendons, guess = held(angle, friction, 2.0)
        np.testing.assert_allclose(at_rest_with(values, tendons, z, 0.9 * guess + 0.01).sum(axis=1), angle, atol=1e-12)


def test_held_pulls_without_friction_give_the_equilibrium() -> None:
    pulls = np.array([[24.0, 6.0]])
    tendons = HeldTendons(pulls, *(np.zeros(1) for _ in range(3)))
    found = at_rest_with(segments(WRIST, 4)[None], tendons, FROM_BELOW, np.full((1, 4), 0.1))
    np.testing.assert_allclose(found[0], equilibrium(WRIST, 4, (12.0, 3.0)), atol=1e-12)


@pytest.mark.parametrize(("drive", "close"), [("spools", 0.01), ("pulls", 0.02)])
def test_the_dead_band_is_that_of_the_linear_formula(drive: str, close: float) -> None:
    """2 (a+ T+ + |a-| T-) sinh(mu phi) / (K + k cosh(mu phi) sum a^2), k = 0 where pulls are held; little friction."""
    angle, friction, sheath = 0.26, 0.01, 1.0
    values, tendons, guess = held(np.array([angle]), friction, sheath, n=1)
    arms = np.abs(terms(values, guess, 0.0 * guess).moment_arms[0, 0])
    pulls = equilibria_at(values, 1, np.array([angle]), 2.0 * WRIST.pretension).pulls
    if drive == "pulls":
        tendons = tendons._replace(given=pulls, stiffness=np.zeros(1))
    below, above = (at_rest_with(values, tendons, z, guess)[0, 0] for z in (FROM_BELOW, FROM_ABOVE))
    exponent = friction * (sheath + angle)
    net = stiffness(WRIST, 1, guess[0], (pulls[0, 0] / 2.0, pulls[0, 1] / 2.0))[0, 0]
    springs = tendons.stiffness[0] * np.cosh(exponent) * (arms**2).sum()
    width = 2.0 * (arms @ pulls[0]) * np.sinh(exponent) / (net + springs)
    assert above - below == pytest.approx(width, rel=close) and below < angle < above


def test_the_dead_band_is_the_same_to_either_side() -> None:
    values, tendons, guess = held(np.array([-0.4, 0.4]), 0.1, 1.0)
    below, above = (at_rest_with(values, tendons, z, guess).sum(axis=1) for z in (FROM_BELOW, FROM_ABOVE))
    assert below[0] == pytest.approx(-above[1], abs=1e-12) and above[0] == pytest.approx(-below[1], abs=1e-12)


def test_where_pulls_grow_faster_than_springs_there_is_no_rest_and_it_is_said() -> None:
    """Held pulls that are exp(3 bend) times as large at the wrist."""
    tendons = HeldTendons(np.array([[24.0, 4.0]]), np.zeros(1), np.full(1, 3.0), np.zeros(1))
    with pytest.raises(UserError, match="no rest was found"):
        at_rest_with(segments(WRIST, 4)[None], tendons, FROM_ABOVE, np.full((1, 4), 0.1))
