from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.learning.domain import Domain
from wristctl.learning.evaluation import angle_errors, error_map
from wristctl.wrist.kinematics import exact_angle

DOMAIN = Domain((-0.8, 0.8), (0.07, 0.09))


def test_errors_of_a_shifted_angle_are_the_shift() -> None:
    true = np.linspace(-1.0, 1.0, 101)
    measured = angle_errors(true + math.radians(0.4), true)
    assert measured.rmse_deg == pytest.approx(0.4) and measured.max_error_deg == pytest.approx(0.4)
    assert measured.close_share == 1.0
    assert measured.r2 == pytest.approx(1.0 - math.radians(0.4) ** 2 / np.mean(true**2))


def test_predicting_the_mean_explains_nothing() -> None:
    true = np.linspace(-0.5, 1.0, 50)
    assert angle_errors(np.full(50, true.mean()), true).r2 == pytest.approx(0.0, abs=1e-15)


def test_close_share_counts_errors_up_to_half_a_degree() -> None:
    error = np.radians([0.0, 0.49, -0.49, 0.51, -3.0])
    assert angle_errors(error, np.zeros(5)).close_share == 0.6


def test_error_map_of_the_exact_inverse_is_rounding_and_reaches_the_corners() -> None:
    result = error_map(exact_angle, DOMAIN, 21, 5)
    assert np.abs(result.error).max() < 1e-15
    assert result.tip.shape == (21, 5, 2)
    assert np.allclose(exact_angle(result.tip[[0, -1]][:, [0, -1]]), [[-0.8, -0.8], [0.8, 0.8]])


def test_an_error_is_what_was_predicted_less_what_is_true_over_angles_by_lengths() -> None:
    found = error_map(lambda tip: exact_angle(tip) + 0.1 * np.linalg.norm(tip, axis=-1), DOMAIN)
    assert found.error.shape == found.theta.shape == (201, 41) and (found.error > 0.0).all()
    np.testing.assert_allclose(found.error, 0.1 * np.linalg.norm(found.tip, axis=-1), atol=1e-12)
    np.testing.assert_allclose(found.theta[:, 0], np.linspace(-0.8, 0.8, 201))
    np.testing.assert_allclose(found.theta, found.theta[:, :1].repeat(41, axis=1))
    straight = found.tip[100]
    np.testing.assert_allclose(straight, np.stack([np.linspace(0.07, 0.09, 41), np.zeros(41)], axis=-1), atol=1e-12)


def test_measures_of_two_errors_by_hand() -> None:
    found = angle_errors(np.radians([1.0, -4.0]), np.radians([-2.0, 0.0]))
    assert found.rmse_deg == pytest.approx(math.sqrt(12.5)) and found.max_error_deg == pytest.approx(4.0)
    assert found.r2 == pytest.approx(1.0 - 25.0 / 2.0) and found.close_share == 0.0
    assert math.isnan(angle_errors(np.zeros(3), np.zeros(3)).r2)
    assert angle_errors(np.array([math.radians(0.5)]), np.zeros(1)).close_share == 1.0
