"""The ellipse of an error in two planes: axes and direction of what was made with them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.simulation.error_ellipse import ErrorEllipse, error_ellipse, mean_ellipse

_SIZES = st.floats(1e-4, 1.0)
_DIRECTIONS = st.floats(-1.57, 1.57)


def around(major: float, minor: float, toward: float, offset: tuple[float, float] = (0.0, 0.0)) -> Array:
    """An error (N, 2) that goes around an ellipse evenly: its standard deviations are the half axes over sqrt 2."""
    turn = np.arange(400) * math.tau / 400
    along, across = major * np.cos(turn), minor * np.sin(turn)
    cosine, sine = math.cos(toward), math.sin(toward)
    return math.sqrt(2.0) * np.column_stack([cosine * along - sine * across, sine * along + cosine * across]) + offset


@given(_SIZES, st.floats(0.05, 0.9), _DIRECTIONS)
def test_axes_and_direction_are_those_the_error_was_made_with_wherever_its_mean_is(
    major: float, ratio: float, toward: float
) -> None:
    found = error_ellipse(around(major, ratio * major, toward, (0.3, -0.2)))
    assert found[:2] == pytest.approx((major, ratio * major), rel=1e-6)
    assert math.sin(found.toward - toward) == pytest.approx(0.0, abs=1e-6), "an axis has no sense"
    assert -0.5 * math.pi < found.toward <= 0.5 * math.pi


def test_its_squared_axes_sum_to_the_squared_error_of_both_planes_about_its_mean() -> None:
    error = np.random.default_rng(3).normal(size=(500, 2)) @ np.array([[2.0, 0.3], [0.0, 0.7]]) + [5.0, -1.0]
    found = error_ellipse(error)
    assert found.major**2 + found.minor**2 == pytest.approx(error.var(axis=0).sum())
    assert found.covariance == pytest.approx(np.cov(error.T, bias=True))


def test_an_error_on_a_line_has_no_width_and_one_toward_flexion_alone_points_there() -> None:
    assert error_ellipse(np.outer(np.linspace(-1.0, 1.0, 50), [1.0, -1.0])).minor == pytest.approx(0.0, abs=1e-7)
    flexion = error_ellipse(np.outer(np.linspace(-1.0, 1.0, 50), [0.0, 1.0]))
    assert flexion.toward == pytest.approx(0.5 * math.pi)


def test_the_mean_of_ellipses_across_each_other_is_round_and_not_the_mean_of_their_directions() -> None:
    one, other = ErrorEllipse(2.0, 0.0, math.radians(80.0)), ErrorEllipse(2.0, 0.0, math.radians(-80.0))
    assert abs(mean_ellipse([one, other]).toward) == pytest.approx(0.5 * math.pi), "20 deg apart, about flexion"
    round_ = mean_ellipse([ErrorEllipse(2.0, 1.0, 0.0), ErrorEllipse(2.0, 1.0, 0.5 * math.pi)])
    assert round_[:2] == pytest.approx((math.sqrt(2.5), math.sqrt(2.5)))
    assert mean_ellipse([one]) == pytest.approx(one, abs=1e-7)


def test_its_outline_is_closed_and_lies_at_so_many_standard_deviations() -> None:
    ellipse = ErrorEllipse(3.0, 1.0, 0.4)
    line = ellipse.outline(2.0)
    away = np.sqrt(np.einsum("ni,ij,nj->n", line, np.linalg.inv(ellipse.covariance), line))
    assert away == pytest.approx(np.full(len(line), 2.0)) and line[0] == pytest.approx(line[-1])
    assert np.hypot(*line.T).max() == pytest.approx(6.0)
