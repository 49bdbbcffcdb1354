from __future__ import annotations

import time
from itertools import accumulate, chain

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.learning.inference import CHUNK, Polynomial, compiled_exact, compiled_polynomial, microseconds
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


def test_an_input_costs_its_share_of_a_chunks_median_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of 1, 2, ... 301 ms in any order, through fifty inputs at most."""
    sizes: list[int] = []

    def angles(inputs: Array) -> Array:
        sizes.append(len(inputs))
        return inputs[:, 0]

    for count, chunk in ((400, CHUNK), (20, 20)):
        clock = accumulate(chain.from_iterable((1.0, 1e-3 * k) for k in np.random.default_rng(0).permutation(301) + 1))
        monkeypatch.setattr(time, "perf_counter", lambda clock=clock: next(clock))
        assert microseconds(angles, np.zeros((count, 2))) == pytest.approx(151e3 / chunk)
        assert next(clock, None) is None and set(sizes) == {chunk} and len(sizes) == 302
        sizes.clear()


def test_a_polynomial_has_every_term_up_to_its_degree_and_finds_one_exactly() -> None:
    def wanted(x: Array) -> Array:
        return 3.0 - 2.0 * x[:, 0] ** 2 * x[:, 1] + 0.5 * x[:, 1] ** 3

    inputs = np.random.default_rng(3).uniform(-1.0, 1.0, (200, 2))
    found = Polynomial.fit(inputs, wanted(inputs), degree=3)
    assert found.degree == 3 and found.powers.sum(axis=1).max() == 3 and len(found.factors) == 10
    assert found.multiply_adds == 10 * 2 + 10
    np.testing.assert_allclose(found.angle(2.0 * inputs), wanted(2.0 * inputs), atol=1e-9)
    assert Polynomial.fit(inputs, wanted(inputs)).degree == 5
    less = Polynomial.fit(inputs, wanted(inputs), degree=2)
    assert np.abs(less.angle(inputs) - wanted(inputs)).max() > 0.1 and len(less.factors) == 6
