"""Physics of the dynamics: two independent forms, closed forms, symmetry, conservation, exact derivatives."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.augmented import equation_of_motion, tendon_columns
from wristctl.config.wrist import WristParameters
from wristctl.wrist.augmented import joints
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import Segments, segments

WRIST = WristParameters()
moved = partial(integrate, PCC)
ANGLE = np.deg2rad(WRIST.range_deg)


def random_state(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-ANGLE, ANGLE, n), rng.normal(0.0, 3.0, n)


@pytest.mark.parametrize("n", range(1, 9))
def test_fast_form_equals_the_papers_augmented_form(n: int) -> None:
    wrist = WRIST.model_copy(update={"gravity": (-8.1, 4.3)})
    values = segments(wrist, n)
    for seed in range(5):
        theta, rate = random_state(n, seed)
        mass, coriolis, gravity, _, pose = equation_of_motion(Segments(*values), theta, rate)
        fast = terms(values, theta, rate)
        np.testing.assert_allclose(fast.mass, mass, rtol=1e-10, atol=1e-14)
        np.testing.assert_allclose(fast.bias, coriolis @ rate + gravity, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(fast.tip, pose, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_tip_force_enters_by_the_transposed_jacobian(n: int) -> None:
    theta, rate = random_state(n, 7)
    free, loaded = segments(WRIST, n), segments(WRIST, n, force=(1.3, -0.7))
    jacobian = equation_of_motion(Segments(*free), theta, rate)[3]
    change = terms(loaded, theta, rate).bias - terms(free, theta, rate).bias
    np.testing.assert_allclose(change, -jacobian.T @ [1.3, -0.7], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("n", [1, 4])
def test_tendon_arms_agree_with_the_augmented_columns(n: int) -> None:
    theta, rate = random_state(n, 3)
    wrist = WRIST.model_copy(update={"discs": n + 1})  # one span per segment
    values = Segments(*segments(wrist, n))
    mu, jacobian, _ = joints(theta, values.length)
    arms = terms(np.array(values), theta, rate).moment_arms
    for k in range(n):
        columns = tendon_columns(mu[4 * k : 4 * k + 4], values.tendon_offset)
        np.testing.assert_allclose(arms[k], jacobian[4 * k : 4 * k + 4, k] @ columns, rtol=1e-12)


def test_mass_of_one_segment_equals_its_closed_form() -> None:
    wrist = WRIST.model_copy(update={"hand_mass": 0.0})
    theta = np.linspace(0.3, 3.0, 20)[:, None]
    m, length, t = wrist.mass, wrist.length, theta[:, 0]
    closed = m * length**2 * (t**2 - 2 * t * np.sin(t) - 2 * np.cos(t) + 2) / (4 * t**4)
    np.testing.assert_allclose(terms(segments(wrist, 1), theta, 0 * theta).mass[:, 0, 0], closed, rtol=1e-11)
    straight = terms(segments(wrist, 1), [0.0], [0.0]).mass[0, 0]
    assert straight == pytest.approx(m * length**2 / 16, rel=1e-15)


@settings(max_examples=60)
@given(n=st.sampled_from([1, 2, 4, 8]), data=st.data())
def test_mass_matrix_is_symmetric_and_positive_definite_over_the_range(n: int, data: st.DataObject) -> None:
    angle = st.floats(-ANGLE, ANGLE)
    theta = np.array(data.draw(st.lists(angle, min_size=n, max_size=n)))
    mass = terms(segments(WRIST, n), theta, np.zeros(n)).mass
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass)[0] > 0.0


@pytest.mark.parametrize("n", [1, 3, 4])
def test_rate_of_mass_matrix_less_twice_coriolis_is_skew(n: int) -> None:
    theta, rate = random_state(n, 11)
    values = Segments(*segments(WRIST, n))
    coriolis = equation_of_motion(values, theta, rate)[1]
    h = 1e-6
    ahead, behind = (terms(np.array(values), theta + s * h * rate, rate).mass for s in (1, -1))
    skew = (ahead - behind) / (2 * h) - 2 * coriolis
    np.testing.assert_allclose(skew, -skew.T, atol=1e-9)


@settings(max_examples=40)
@given(n=st.sampled_from([1, 2, 4]), seed=st.integers(0, 10_000))
def test_jacobians_are_the_derivatives_of_the_residual(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = segments(WRIST.model_copy(update={"gravity": (-7.0, 5.0)}), n, force=(0.4, -1.1))
    theta, rate = random_state(n, seed)
    acceleration, pulls = rng.normal(0.0, 30.0, n), rng.uniform(0.0, 60.0, 2)
    _, by_theta, by_rate = linearised(values, theta, rate, acceleration, pulls)
    h = 1e-5 * np.eye(n)
    for column in range(n):
        for exact, angle, speed in ((by_theta, h[column], 0.0), (by_rate, 0.0, h[column])):
            ahead = linearised(values, theta + angle, rate + speed, acceleration, pulls)[0]
            behind = linearised(values, theta - angle, rate - speed, acceleration, pulls)[0]
            np.testing.assert_allclose(exact[:, column], (ahead - behind) / 2e-5, rtol=1e-6, atol=1e-7)


def test_segments_of_equal_angle_form_one_arc() -> None:
    one = terms(segments(WRIST, 1), [0.9], [0.0]).tip
    for n in range(2, 9):
        np.testing.assert_allclose(terms(segments(WRIST, n), np.full(n, 0.9 / n), np.zeros(n)).tip, one, rtol=1e-13)


def test_left_is_the_mirror_of_right() -> None:
    values = segments(WRIST, 4)
    still, times = np.zeros(4), np.arange(1, 11) * 0.1
    right = moved(values, still, still, [30.0, 4.0], times)[0]
    left = moved(values, still, still, [4.0, 30.0], times)[0]
    np.testing.assert_allclose(right, -left, rtol=0, atol=1e-13)
    assert np.abs(right).max() > 0.1


def energy(values: np.ndarray, theta: np.ndarray, rate: np.ndarray) -> float:
    s = Segments(*values)
    at = terms(values, theta, rate)
    mass = s.hand_mass * (at.tip[:2] + s.hand_offset * np.array([np.cos(at.tip[2]), np.sin(at.tip[2])]))
    end = np.zeros(2)
    for k in range(len(theta)):
        place = terms(values, theta[: k + 1], rate[: k + 1]).tip[:2]
        mass = mass + 0.5 * s.mass * (end + place)
        end = place
    height = -np.dot([s.gravity_x, s.gravity_y], mass)
    return float(0.5 * rate @ at.mass @ rate + height + 0.5 * s.stiffness * theta @ theta)


@pytest.mark.parametrize("n", [1, 2])
def test_energy_is_conserved_without_damping_to_the_integrators_order(n: int) -> None:
    values = segments(WRIST.model_copy(update={"damping": 0.0, "mass": 0.5}), n)
    theta, rate = np.linspace(0.2, 0.4, n), np.zeros(n)
    before = energy(values, theta, rate)
    drift = []
    for h in (4e-4, 2e-4, 1e-4):
        late, late_rate = moved(values, theta, rate, [0.0, 0.0], [0.5], h)
        drift.append(abs(energy(values, late[-1], late_rate[-1]) - before))
    assert drift[-1] < 1e-6 * before
    assert drift[0] / drift[1] > 6.0 and drift[1] / drift[2] > 6.0


@pytest.mark.parametrize("n", [1, 4])
def test_integrator_converges_with_third_order(n: int) -> None:
    values = segments(WRIST, n)
    still = np.zeros(n)
    fine = moved(values, still, still, [25.0, 4.0], [0.08], 1e-5)[0]
    errors = [np.abs(moved(values, still, still, [25.0, 4.0], [0.08], h)[0] - fine).max() for h in (4e-3, 2e-3, 1e-3)]
    assert all(errors[i] / errors[i + 1] > 5.0 for i in range(2)), errors


def test_times_between_steps_are_refused() -> None:
    with pytest.raises(ValueError, match="whole numbers of steps"):
        moved(segments(WRIST, 1), [0.0], [0.0], [1.0, 1.0], [0.0105], 1e-3)
