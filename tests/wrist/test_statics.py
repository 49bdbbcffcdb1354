"""Equilibria: nothing is left to move the wrist, and what tips over is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import balance, equilibrium, least_stiffness, stiffness, straight_stiffness
from wristctl.wrist.tendons import TENDONS_PER_SIDE

LEANING = WristParameters().model_copy(update={"gravity": (-6.0, 7.0)})


def left_over(wrist: WristParameters, theta: np.ndarray, tensions: tuple[float, float]) -> np.ndarray:
    """Torque [N m] on each segment that nothing balances."""
    here = terms(segments(wrist, len(theta)), theta, np.zeros(len(theta)))
    pulled = here.moment_arms @ (TENDONS_PER_SIDE * np.asarray(tensions))
    return np.asarray(pulled - here.bias - len(theta) * wrist.stiffness * theta)


@settings(deadline=None, max_examples=25)
@given(st.integers(1, 5), st.floats(0.0, 12.0), st.floats(0.0, 12.0))
def test_at_rest_every_segments_torques_are_balanced(n: int, plus: float, minus: float) -> None:
    theta = equilibrium(LEANING, n, (plus, minus))
    assert theta.shape == (n,) and np.abs(left_over(LEANING, theta, (plus, minus))).max() < 1e-9


def test_the_stronger_side_wins_and_the_other_side_is_its_mirror_image() -> None:
    upright = WristParameters()
    right, left = equilibrium(upright, 4, (9.0, 2.0)), equilibrium(upright, 4, (2.0, 9.0))
    assert right.sum() > 0.1
    np.testing.assert_allclose(left, -right, atol=1e-12)
    np.testing.assert_allclose(equilibrium(upright, 4, (5.0, 5.0)), 0.0, atol=1e-12)


def test_a_wrist_whose_least_stiffness_is_negative_has_no_equilibrium() -> None:
    for mass in (0.3, 0.9):
        heavy = WristParameters().model_copy(update={"hand_mass": mass})
        if least_stiffness(heavy, 3) > 0.0:
            np.testing.assert_allclose(equilibrium(heavy, 3, (2.0, 2.0)), 0.0, atol=1e-9)
        else:
            with pytest.raises(UserError, match="buckles") as error:
                equilibrium(heavy, 3, (2.0, 3.0))
            assert error.value.where == "wrist"


WRISTS = st.builds(
    WristParameters,
    length=st.floats(0.05, 0.2), mass=st.floats(0.01, 1.0), hand_mass=st.floats(0.0, 1.0),
    hand_offset=st.floats(0.0, 0.1), stiffness=st.floats(0.1, 5.0), pretension=st.floats(0.0, 30.0),
    discs=st.sampled_from([9, 17]), gravity=st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)),
)  # fmt: skip


@settings(deadline=None, max_examples=30)
@given(WRISTS, st.sampled_from([1, 2, 4, 8]))
def test_the_straight_wrists_stiffness_in_closed_form_is_the_compiled_models(wrist: WristParameters, n: int) -> None:
    compiled = stiffness(wrist, n, np.zeros(n), (wrist.pretension, wrist.pretension))
    np.testing.assert_allclose(straight_stiffness(wrist, n), compiled, rtol=1e-11, atol=1e-12)


@settings(deadline=None, max_examples=30)
@given(WRISTS, st.floats(-5.0, 5.0))
def test_what_holds_one_arc_and_its_moment_arms_are_the_compiled_models(wrist: WristParameters, force: float) -> None:
    theta = np.append(np.linspace(-2.5, 2.5, 12), [0.0, 1e-9, -1e-5])
    compiled = terms(segments(wrist, 1, (0.0, force)), theta[:, None], 0.0 * theta[:, None])
    found = balance(wrist, theta, force)
    np.testing.assert_allclose(found.asked, compiled.bias[:, 0] + wrist.stiffness * theta, atol=1e-13)
    np.testing.assert_allclose(found.arm_plus, compiled.moment_arms[:, 0, 0], atol=1e-16)
    np.testing.assert_allclose(found.arm_minus, compiled.moment_arms[:, 0, 1], atol=1e-16)
