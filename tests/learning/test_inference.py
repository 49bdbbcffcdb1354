from __future__ import annotations

import numpy as np

from wristctl.learning.baseline import Polynomial
from wristctl.learning.inference import compiled_exact, compiled_polynomial
from wristctl.wrist.kinematics import arc_tip, exact_angle

TIPS = np.random.default_rng(2).uniform((0.05, -0.05), (0.09, 0.05), (300, 2))


def test_compiled_polynomial_and_exact_inverse_equal_the_plain_ones() -> None:
    polynomial = Polynomial.fit(TIPS, exact_angle(TIPS), degree=3)
    np.testing.assert_allclose(compiled_polynomial(polynomial)(TIPS), polynomial.angle(TIPS), rtol=0, atol=1e-12)
    np.testing.assert_allclose(compiled_exact(TIPS), exact_angle(TIPS), rtol=0, atol=1e-15)


def test_a_polynomial_of_degree_5_nearly_is_the_exact_inverse_of_an_arc() -> None:
    theta, length = np.random.default_rng(0).uniform((-0.87, 0.072), (0.87, 0.088), (500, 2)).T
    polynomial = Polynomial.fit(arc_tip(theta, length), theta)
    grid = arc_tip(np.linspace(-0.8, 0.8, 101), 0.08)
    assert len(polynomial.factors) == 21
    assert np.abs(np.degrees(polynomial.angle(grid) - exact_angle(grid))).max() < 0.02
