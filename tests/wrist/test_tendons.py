"""Tendons, allocation and statics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.statics import equilibrium, least_stiffness, stiffness
from wristctl.wrist.tendons import allocate, moment_arms, reach

WRIST = WristParameters()


@kernel
def _allocate(parameters: Any, asked: Any, out: Any) -> None:
    wrist, row, result = load_segments(rows_of(parameters)), rows_of(asked), rows_of(out)
    result[0], result[1] = reach(row[0], wrist, row[2], row[3])
    plus, minus = allocate(row[0], wrist, row[1], row[2], row[3])
    result[2] = plus
    result[3] = minus
    arms = moment_arms(wrist, row[0])
    result[4] = arms[0] * plus + arms[1] * minus


def allocated(theta: float, torque: float, low: float, high: float) -> np.ndarray:
    out = np.zeros(5)
    _allocate(segments(WRIST, 1), np.array([theta, torque, low, high]), out)
    return out


@settings(max_examples=300)
@given(
    theta=st.floats(-0.9, 0.9),
    torque=st.floats(-3.0, 3.0),
    low=st.floats(0.0, 40.0),
    room=st.floats(1.0, 120.0),
)
@pytest.mark.slow
def test_allocated_torque_is_the_wanted_one_wherever_it_can_be_reached(
    theta: float, torque: float, low: float, room: float
) -> None:
    least, most, plus, minus, achieved = allocated(theta, torque, low, low + room)
    assert low <= plus <= low + room and low <= minus <= low + room
    assert achieved == pytest.approx(min(max(torque, least), most), abs=1e-9)
    assert min(plus, minus) == pytest.approx(low, abs=1e-12) or achieved != pytest.approx(torque, abs=1e-9)


def test_without_an_upper_limit_every_torque_is_reached() -> None:
    for torque in (-1e6, -1.0, 0.0, 1e6):
        assert allocated(0.3, torque, 4.0, np.inf)[4] == pytest.approx(torque, rel=1e-12, abs=1e-12)


def test_moment_arms_are_the_slopes_of_tendon_lengths() -> None:
    h = 1e-6
    for n in (1, 2, 4):
        values = segments(WRIST, n)
        theta = np.linspace(-0.5, 0.5, n)
        ahead, behind = (terms(values, theta + s * h, 0 * theta).tendon_lengths for s in (1, -1))
        arms = terms(values, theta, 0 * theta).moment_arms
        np.testing.assert_allclose(arms, (behind - ahead) / (2 * h), rtol=1e-8)


def test_tendons_that_span_the_whole_wrist_at_once_would_buckle_it() -> None:
    tight = WRIST.model_copy(update={"pretension": 15.0})  # 60 N of total tension
    assert least_stiffness(WRIST.model_copy(update={"pretension": 0.0}), 1) == pytest.approx(0.353, abs=5e-4)
    assert least_stiffness(tight, 1) == pytest.approx(0.328, abs=1e-3)
    assert least_stiffness(tight.model_copy(update={"discs": 2}), 1) == pytest.approx(-0.047, abs=1e-3)


@pytest.mark.parametrize("n", [1, 4])
def test_equilibrium_is_where_the_motion_ends(n: int) -> None:
    still = np.zeros(n)
    at_rest = equilibrium(WRIST, n, (8.0, 2.0))
    late = integrate(PCC, segments(WRIST, n), still, still, [16.0, 4.0], [15.0])[0][-1]
    np.testing.assert_allclose(at_rest, late, rtol=0, atol=1e-9)
    assert at_rest.sum() > 0.1


def test_a_buckling_wrist_has_no_equilibrium_to_offer() -> None:
    heavy = WRIST.model_copy(update={"hand_mass": 0.9})
    assert least_stiffness(heavy, 4) < 0.0
    with pytest.raises(UserError, match="buckles"):
        equilibrium(heavy, 4, (2.0, 2.0))


@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_without_gravity_and_tension_a_wrist_is_as_stiff_as_its_springs_however_finely_it_is_cut(n: int) -> None:
    """Springs in series: a torque at the tip bends n of them, each n times as stiff, by 1/n of the angle."""
    free = WRIST.model_copy(update={"gravity": (0.0, 0.0), "pretension": 0.0})
    assert least_stiffness(free, n) == pytest.approx(free.stiffness, rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_the_least_stiffness_bounds_what_a_torque_at_the_tip_meets(n: int) -> None:
    """1/compliance of the tip angle under a torque at the tip is never below the least stiffness."""
    tangent = stiffness(WRIST, n, np.zeros(n), (WRIST.pretension, WRIST.pretension))
    compliance = np.ones(n) @ np.linalg.solve(tangent, np.ones(n))
    least = least_stiffness(WRIST, n)
    assert 0.5 / compliance < least <= 1.0 / compliance * (1.0 + 1e-12)
