from __future__ import annotations

import mpmath
import numpy as np
import pytest

from wristctl.wrist.kinematics import TipPath, arc_tip, exact_arc, exact_inverse


@pytest.mark.parametrize("theta", [0.0, 1e-300, 1e-9, -3e-5, 0.5, -0.87, 3.0])
def test_arc_tip_matches_e1_in_forty_digits(theta: float) -> None:
    with mpmath.workdps(40):
        t, length = mpmath.mpf(theta), mpmath.mpf(0.08)
        if theta == 0.0:
            wanted = (0.08, 0.0)
        else:
            wanted = (float(length * mpmath.sin(t) / t), float(length * 2 * mpmath.sin(t / 2) ** 2 / t))
    np.testing.assert_allclose(arc_tip(np.array(theta), np.array(0.08)), wanted, rtol=1e-15, atol=0.0)


def test_exact_inverse_follows_an_ellipse_with_its_derivatives() -> None:
    time, step = np.linspace(0.0, 1.0, 200), 1e-4

    def position(t: np.ndarray) -> np.ndarray:
        return np.stack([0.07 + 0.008 * np.cos(5 * t), 0.03 * np.sin(5 * t)], axis=-1)

    velocity = np.stack([-0.04 * np.sin(5 * time), 0.15 * np.cos(5 * time)], axis=-1)
    acceleration = np.stack([-0.2 * np.cos(5 * time), -0.75 * np.sin(5 * time)], axis=-1)
    path = exact_inverse(TipPath(position(time), velocity, acceleration))
    before, here, after = (exact_arc(position(time + k * step))[0] for k in (-1, 0, 1))
    np.testing.assert_array_equal(path.theta, here)
    np.testing.assert_allclose(path.rate, (after - before) / (2 * step), rtol=0, atol=1e-5)
    np.testing.assert_allclose(path.acceleration, (after - 2 * here + before) / step**2, rtol=0, atol=1e-4)
    assert not path.outside.any()


def test_stretching_along_the_chord_does_not_turn_the_wrist() -> None:
    tip = arc_tip(np.array([0.6]), np.array([0.08]))
    path = exact_inverse(TipPath(tip, 0.3 * tip, -2.0 * tip))
    np.testing.assert_allclose([path.rate, path.acceleration], 0.0, atol=1e-15)


def test_tip_at_the_base_has_no_angle_and_is_flagged() -> None:
    path = exact_inverse(TipPath(np.array([[0.0, 0.0], [0.08, 0.0]]), np.zeros((2, 2)), np.zeros((2, 2))))
    assert path.outside.tolist() == [True, False]


def test_exact_arc_undoes_arc_tip() -> None:
    theta, length = np.array([-3.0, -0.5, 0.0, 1e-9, 2.0]), np.array([0.07, 0.08, 0.09, 0.08, 0.1])
    back = exact_arc(arc_tip(theta, length))
    np.testing.assert_allclose(back[0], theta, rtol=0, atol=1e-15)
    np.testing.assert_allclose(back[1], length, rtol=1e-14)
