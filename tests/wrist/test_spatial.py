"""Physics of the wrist in two planes: two independent forms, the planar slice, symmetry, conservation, statics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.spatial_augmented import augmented_residual, augmented_tendons, spatial_augmented
from tests.oracles.spatial_energy import spatial_energy
from tests.wrist.turned_in_space import turned
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist import statics
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import exact_bend, spatial_frames, spatial_tips
from wristctl.wrist.spatial.spatial_model import spatial_linearised, spatial_terms
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialSegments, ellipse, spatial_values
from wristctl.wrist.spatial.spatial_statics import (
    least_spatial_stiffness,
    spatial_equilibrium,
    spatial_stiffness,
)
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

N = 2  # one kernel for all
WRIST = WristParameters(gravity=(-7.0, 3.0), gravity_flexion=4.0, flexion_ratio=1.7)
FOUR = TendonLayout.four(WRIST.tendon_radius)
# four, one of which ends at the disc in the middle
UNEVEN = TendonLayout(
    (TendonPlace(0.3, 0.02), TendonPlace(2.1, 0.015, ends_at=3), TendonPlace(3.9, 0.02), TendonPlace(5.0, 0.01))
)
OBLIQUE: dict[str, Any] = {"axis": np.deg2rad(30.0), "damping_ratio": 2.0}
VALUES = spatial_values(WRIST, UNEVEN, N, (0.4, -1.1, 0.7), **OBLIQUE)

bends = st.lists(st.floats(-1.4, 1.4), min_size=2 * N, max_size=2 * N).map(np.array)
rates = st.lists(st.floats(-8.0, 8.0), min_size=2 * N, max_size=2 * N).map(np.array)
tensions = st.lists(st.floats(0.0, 60.0), min_size=4, max_size=4).map(np.array)


@given(q=bends)
@pytest.mark.slow
def test_cross_sections_end_at_the_compiled_models_tip_and_hold_its_tendons(q: np.ndarray) -> None:
    terms = spatial_terms(VALUES, q, 0.0 * q)
    centres, frames = spatial_frames(q, WRIST.length, np.linspace(0.0, 1.0, WRIST.discs))
    np.testing.assert_allclose(centres[-1], terms.tip, atol=1e-15)
    np.testing.assert_allclose(frames[-1], terms.frame, atol=1e-14)
    for place, (y, z), length in zip(UNEVEN.places, UNEVEN.cross_section, terms.lengths, strict=True):
        through = (centres + frames @ np.array([0.0, y, z]))[: place.ends_at]
        assert np.linalg.norm(np.diff(through, axis=0), axis=1).sum() == pytest.approx(length, abs=1e-14)


@given(bend=st.tuples(st.floats(-2.2, 2.2), st.floats(-2.2, 2.2)).map(np.array), length=st.floats(0.01, 1.0))
def test_the_one_arc_that_ends_at_a_tip_is_found_again(bend: np.ndarray, length: float) -> None:
    found, along = exact_bend(spatial_tips(bend, length))
    np.testing.assert_allclose(found, bend, atol=1e-12)
    assert along == pytest.approx(length, rel=1e-12)


@settings(max_examples=25)
@given(q=bends, rate=rates)
def test_fast_form_equals_the_augmented_form(q: np.ndarray, rate: np.ndarray) -> None:
    at, chain = spatial_terms(VALUES, q, rate), spatial_augmented(VALUES, q, rate)
    np.testing.assert_allclose(at.mass, chain.mass, rtol=1e-10, atol=1e-14)
    load = chain.tip_jacobian.T @ VALUES[FIELDS - 3 : FIELDS]
    np.testing.assert_allclose(at.bias, chain.coriolis @ rate + chain.gravity - load, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(at.tip, chain.tip, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(at.frame, chain.rotation, atol=1e-14)
    lengths, arms = augmented_tendons(VALUES, q)
    np.testing.assert_allclose(at.lengths, lengths, rtol=1e-13)
    np.testing.assert_allclose(at.moment_arms, arms, rtol=1e-12, atol=1e-16)


@settings(max_examples=25)
@given(q=bends, rate=rates, acceleration=rates, pulls=tensions, passive=st.booleans())
@pytest.mark.slow
def test_jacobians_are_the_analytic_derivatives_of_the_augmented_residual(
    q: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, pulls: np.ndarray, passive: bool
) -> None:
    """By complex steps, which round nothing off; without springs and dampers too, which hide what motion adds."""
    values = VALUES.copy()
    if not passive:
        values[SpatialSegments._fields.index("stiffness_yy") : SpatialSegments._fields.index("gravity_x")] = 0.0
    acceleration = 5.0 * acceleration
    r, by_q, by_rate = spatial_linearised(values, q, rate, acceleration, pulls)
    expected = augmented_residual(values, q, rate, acceleration, pulls)
    np.testing.assert_allclose(r, expected, rtol=1e-9, atol=1e-11)
    for column in range(2 * N):
        step = 1e-30j * np.eye(2 * N)[column]
        for exact, angle, speed in ((by_q, step, 0.0), (by_rate, 0.0, step)):
            derivative = augmented_residual(values, q + angle, rate + speed, acceleration, pulls).imag / 1e-30
            np.testing.assert_allclose(exact[:, column], derivative, rtol=1e-8, atol=1e-10)


@settings(max_examples=40)
@given(q=bends)
def test_mass_matrix_is_symmetric_and_positive_definite(q: np.ndarray) -> None:
    mass = spatial_terms(VALUES, q, np.zeros(2 * N)).mass
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass)[0] > 0.0


@settings(max_examples=20)
@given(q=bends, rate=rates)
def test_rate_of_mass_matrix_less_twice_coriolis_is_skew(q: np.ndarray, rate: np.ndarray) -> None:
    coriolis = spatial_augmented(VALUES, q, rate).coriolis
    growing = spatial_augmented(VALUES, q + 1e-30j * rate, rate).mass.imag / 1e-30
    skew = growing - 2.0 * coriolis
    np.testing.assert_allclose(skew, -skew.T, atol=1e-13)


@settings(max_examples=30)
@given(q=bends, rate=rates)
def test_tip_bend_is_the_angle_between_tangents_and_its_rate_that_angles(q: np.ndarray, rate: np.ndarray) -> None:
    at = spatial_terms(VALUES, q, rate)
    tangent = at.frame[:, 0]
    angle = np.hypot(*at.bend[:2])
    assert np.cos(angle) == pytest.approx(tangent[0], abs=1e-13)
    np.testing.assert_allclose(at.bend[:2] * np.sinc(angle / np.pi), tangent[1:], atol=1e-14)
    if angle < 2.8:  # not where it turns back on itself
        h = 1e-6
        ahead, behind = (spatial_terms(VALUES, q + s * h * rate, rate).bend[:2] for s in (1.0, -1.0))
        np.testing.assert_allclose(at.bend[2:], (ahead - behind) / (2.0 * h), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-7, 1.1e-7, 1e-5])
def test_rate_of_the_bend_is_exact_where_the_wrist_is_nearly_straight(size: float) -> None:
    """Two segments in line bend alike: the whole bends by their sum."""
    q, rate = size * np.array([0.6, 0.8, 0.6, 0.8]), np.array([1.0, -2.0, 1.0, -2.0])
    at = spatial_terms(VALUES, q, rate)
    np.testing.assert_allclose(at.bend[:2], 2.0 * q[:2], atol=1e-20)
    np.testing.assert_allclose(at.bend[2:], 2.0 * rate[:2], atol=1e-8 * max(1.0, size * 1e9))


def test_a_quarter_bend_to_each_side_in_turn_is_no_sum() -> None:
    """By a right angle toward ulnar, then by one toward flexion in the bent axes: the tangent stays across."""
    q = np.array([np.pi / 2.0, 0.0, 0.0, np.pi / 2.0])
    tangent = spatial_terms(VALUES, q, 0.0 * q).frame[:, 0]
    np.testing.assert_allclose(tangent, [0.0, 0.0, 1.0], atol=1e-15)


def of_plane(plane: str) -> tuple[np.ndarray, np.ndarray, slice]:
    """A wrist that gravity, load and tendons bend in one plane: planar values, spatial values, its coordinates."""
    wrist = WristParameters(gravity=(-8.0, 3.0))
    planar = segments(wrist, N, (0.3, 0.8))
    spatial = spatial_values(wrist, FOUR, N, (0.3, 0.8, 0.0))
    return (
        planar,
        spatial if plane == "ulnar" else turned(SpatialSegments._fields, spatial, np.pi / 2.0),
        slice(int(plane == "flexion"), None, 2),
    )


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
@pytest.mark.slow
def test_in_one_plane_it_is_the_planar_wrist(plane: str) -> None:
    """Tendons 1 and 2 pull toward radial, 4 and 5 toward ulnar; turned about x the other plane is the same."""
    planar, spatial, own = of_plane(plane)
    times = np.arange(0.02, 1.01, 0.02)
    pulls, start, rate = np.array([5.0, 31.0]), np.array([0.3, -0.5]), np.array([2.0, -4.0])
    theta, omega = integrate(PCC, planar, start, rate, pulls, times)
    q, speed = np.zeros(2 * N), np.zeros(2 * N)
    q[own], speed[own] = start, rate
    each = 0.5 * pulls[[1, 1, 0, 0]]
    bent, moving = integrate(PCC_IN_SPACE, spatial, q, speed, each, times)
    np.testing.assert_allclose(bent[:, own], theta, atol=1e-12)
    np.testing.assert_allclose(moving[:, own], omega, atol=1e-11)
    np.testing.assert_allclose(bent[:, slice(1 - own.start, None, 2)], 0.0, atol=1e-13)
    np.testing.assert_allclose(spatial_terms(spatial, bent, moving).bend[:, own.start], theta.sum(axis=1), atol=1e-12)


@settings(max_examples=15)
@given(q=bends, rate=rates, pulls=tensions, by=st.sampled_from([0.5 * np.pi, np.pi, -1.1, 0.3]))
def test_turning_everything_about_the_tangent_turns_the_motion(
    q: np.ndarray, rate: np.ndarray, pulls: np.ndarray, by: float
) -> None:
    """The ellipse of stiffness turns with it."""
    turn = np.array([[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]])
    times = [0.02, 0.1]
    end, speed = integrate(PCC_IN_SPACE, VALUES, q, rate, pulls, times)

    def aside(pairs: np.ndarray) -> np.ndarray:
        return (pairs.reshape(-1, 2) @ turn.T).reshape(pairs.shape)

    end_aside, speed_aside = integrate(
        PCC_IN_SPACE, turned(SpatialSegments._fields, VALUES, by), aside(q), aside(rate), pulls, times
    )
    np.testing.assert_allclose(end_aside, aside(end), atol=1e-12)
    np.testing.assert_allclose(speed_aside, aside(speed), atol=1e-10)


def test_an_ellipse_has_its_values_along_and_across_its_axis() -> None:
    yy, yz, zz = ellipse(3.0, 5.0, np.deg2rad(30.0))
    matrix = np.array([[yy, yz], [yz, zz]])
    along = np.array([np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)])
    np.testing.assert_allclose(matrix @ along, 3.0 * along, rtol=1e-14)
    np.testing.assert_allclose(matrix @ [-along[1], along[0]], 5.0 * np.array([-along[1], along[0]]), rtol=1e-14)
    np.testing.assert_allclose(ellipse(3.0, 3.0, 0.7), [3.0, 0.0, 3.0], atol=1e-15)


@pytest.mark.parametrize("damped", [False, True])
def test_energy_stays_without_damping_and_falls_with_it(damped: bool) -> None:
    """Without damping what the method takes is its error, an eighth of it at half the step."""
    values = VALUES.copy()
    if not damped:
        first = SpatialSegments._fields.index("damping_yy")
        values[first : first + 3] = 0.0
    q, rate, pulls = np.array([0.4, -0.2, 0.1, 0.3]), np.array([3.0, 5.0, -2.0, 4.0]), np.array([12.0, 3.0, 8.0, 20.0])
    times, drift = np.arange(0.01, 0.1, 0.01), []
    for h in (1e-4, 5e-5):
        bent, moving = integrate(PCC_IN_SPACE, values, q, rate, pulls, times, h)
        energy = spatial_energy(values, np.vstack([q, bent]), np.vstack([rate, moving]), pulls)
        drift.append(np.abs(energy - energy[0]).max())
    if damped:
        assert (np.diff(energy) < 0.0).all() and drift[1] > 0.1
    else:
        assert drift[1] < 2e-5 and drift[0] / drift[1] == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize("pulls", [(2.0, 2.0, 29.0, 2.0), (6.0, 15.0, 2.0, 4.0)])
def test_a_long_time_ends_at_the_equilibrium(pulls: tuple[float, ...]) -> None:
    rest = spatial_equilibrium(VALUES, N, pulls)
    end, speed = integrate(PCC_IN_SPACE, VALUES, np.zeros(2 * N), np.zeros(2 * N), pulls, [20.0])
    np.testing.assert_allclose(end[0], rest, atol=1e-9)
    np.testing.assert_allclose(speed[0], 0.0, atol=1e-8)
    assert np.abs(rest).max() > 0.1


def test_stiffness_is_symmetric_and_least_as_in_the_plane() -> None:
    wrist = WristParameters()
    values, pulls = spatial_values(wrist, FOUR, N), np.full(4, wrist.pretension)
    assert least_spatial_stiffness(values, N, pulls) == pytest.approx(statics.least_stiffness(wrist, N), rel=1e-12)
    tangent = spatial_stiffness(VALUES, np.array([0.5, -0.3, 0.2, 0.4]), (5.0, 9.0, 2.0, 7.0))
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-13)


def test_the_softer_axis_buckles_first() -> None:
    """Gravity presses on the upright wrist: of an ellipse the soft axis decides, whatever its direction."""
    wrist = WristParameters(flexion_ratio=0.5)
    pulls = np.full(4, wrist.pretension)
    least = [least_spatial_stiffness(spatial_values(wrist, FOUR, N, axis=axis), N, pulls) for axis in (0.0, 0.5, 1.4)]
    soft = WristParameters(stiffness=0.5 * wrist.stiffness)
    np.testing.assert_allclose(least, statics.least_stiffness(soft, N), rtol=1e-9)
    heavy = WristParameters(hand_mass=2.0, flexion_ratio=0.5)
    assert least_spatial_stiffness(spatial_values(heavy, FOUR, N), N, pulls) < 0.0
    with pytest.raises(UserError, match="buckles"):
        spatial_equilibrium(spatial_values(heavy, FOUR, N), N, pulls)


def test_a_tendon_that_ends_inside_leaves_what_lies_beyond_alone() -> None:
    values = spatial_values(WRIST, UNEVEN, N)
    arms = spatial_terms(values, np.array([0.3, 0.2, -0.4, 0.1]), np.zeros(2 * N)).moment_arms
    assert (arms[1, 2:] == 0.0).all() and (np.abs(arms[1, :2]) > 1e-3).all()
    assert (np.abs(arms[[0, 2, 3], 2:]) > 1e-4).all()
