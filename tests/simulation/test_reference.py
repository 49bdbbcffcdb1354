"""References: angles, tip paths, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from wristctl.config.errors import UserError
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.learning.domain import Domain
from wristctl.learning.network import Network, Scaler
from wristctl.simulation.motion import Motion
from wristctl.simulation.reference import motion
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.kinematics import arc_path, arc_tip, chain_tip, exact_arc
from wristctl.wrist.segments import segments

WRIST = WristParameters()


def evaluated(**reference: object) -> Motion:
    return motion(Reference.model_validate(reference), WRIST, 3.0, 1e-3)


def test_minimum_jerk_starts_and_ends_at_rest_and_derivatives_agree() -> None:
    m = evaluated(duration=2.0)
    assert m.theta_ref[0] == 0.0 and m.final == pytest.approx(np.deg2rad(30.0))
    assert m.rate_ref[[0, 2000]].tolist() == [0.0, 0.0] and m.acceleration_ref[[0, 2000]].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.gradient(m.theta_ref, m.time)[1:-1], m.rate_ref[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(m.rate_ref, m.time)[1:-1], m.acceleration_ref[1:-1], atol=2e-3)


@given(st.floats(-0.8, 0.8), st.floats(0.05, 0.12), st.sampled_from(["step", "minimum-jerk", "sine"]))
def test_the_wanted_angle_is_the_closed_form_inverse_of_the_wanted_tip(angle: float, length: float, kind: str) -> None:
    x, y = (float(v) for v in arc_tip(np.array(angle), length))
    m = evaluated(kind=kind, tip=(x, y), inverse="closed-form", duration=0.7, frequency=0.8)
    np.testing.assert_allclose(exact_arc(m.tip_desired)[0], m.theta_ref, rtol=0.0, atol=1e-15)


def test_a_tip_target_is_reached_whatever_its_stretch() -> None:
    tip = arc_tip(np.array(0.4), 0.084)
    m = evaluated(tip=tuple(float(v) for v in tip), inverse="closed-form")
    assert m.final == pytest.approx(0.4, abs=1e-14)
    np.testing.assert_allclose(m.tip_desired[-1], tip, atol=1e-16)
    np.testing.assert_allclose(m.tip_desired[0], [WRIST.length, 0.0], atol=1e-16)
    np.testing.assert_allclose(exact_arc(m.tip_desired[-1]), [0.4, 0.084], rtol=1e-13)


def test_impossible_references_are_refused() -> None:
    with pytest.raises(UserError, match="beyond the wrist's range"):
        evaluated(angle_deg=51.0)
    with pytest.raises(UserError, match="beyond the range"):
        evaluated(tip=(0.0, 0.08), inverse="closed-form")
    with pytest.raises(UserError, match="network"):
        evaluated(inverse="network")
    with pytest.raises(ValidationError, match="not both"):
        Reference(angle_deg=10.0, tip=(0.08, 0.0), inverse="closed-form")
    with pytest.raises(ValidationError, match="needs inverse"):
        Reference(tip=(0.08, 0.0))


def test_the_share_of_tips_that_a_network_never_learned_is_told() -> None:
    weight = (np.array([[0.0, 1.0]]), np.array([[1.0]]))
    scaler = Scaler(np.zeros(2), np.ones(2)), Scaler(np.zeros(1), np.ones(1))
    domain = Domain((-0.3, 0.3), (0.07, 0.09))
    network = Network(weight, (np.zeros(1), np.zeros(1)), "tanh", *scaler, domain)
    m = motion(Reference(inverse="network", duration=2.0), WRIST, 3.0, 1e-3, network.along)
    assert m.outside == np.mean(evaluated(duration=2.0).theta_ref > 0.3) > 0.3
    assert evaluated(inverse="closed-form").outside == 0.0


def test_chain_tip_equals_the_compiled_kinematics() -> None:
    angles = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 4))
    np.testing.assert_allclose(
        chain_tip(angles, WRIST.length), terms(segments(WRIST, 4), angles, 0 * angles).tip[:, :2], atol=1e-15
    )


def test_sine_swings_between_straight_and_the_angle_and_never_rests() -> None:
    m = evaluated(kind="sine", frequency=0.5, angle_deg=20.0)
    np.testing.assert_allclose(m.theta_ref[[0, 1000, 2000]], np.deg2rad([0.0, 20.0, 0.0]), atol=1e-15)
    np.testing.assert_allclose(np.gradient(m.theta_ref, m.time)[1:-1], m.rate_ref[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(m.rate_ref, m.time)[1:-1], m.acceleration_ref[1:-1], atol=1e-4)
    assert m.rest == m.horizon


def test_multi_step_holds_each_angle_for_its_duration() -> None:
    m = evaluated(kind="multi-step", angles_deg=(10.0, -20.0, 5.0), duration=0.5)
    np.testing.assert_allclose(np.rad2deg(m.theta_ref[[0, 499, 500, 999, 1000, 2999]]), [10, 10, -20, -20, 5, 5])
    assert (m.begin, m.rest) == (1.0, 1.0) and m.goals.move == pytest.approx(np.deg2rad(25.0))
    assert not m.rate_ref.any()


def test_tip_path_visits_its_tips_and_rests_at_each() -> None:
    tips = tuple(tuple(float(v) for v in arc_tip(np.array(a), r)) for a, r in ((0.4, 0.082), (-0.2, 0.079)))
    m = evaluated(kind="tip-path", tips=tips, duration=0.8, inverse="closed-form")
    np.testing.assert_allclose(m.tip_desired[[800, 1600]], tips, atol=1e-15)
    np.testing.assert_allclose(m.theta_ref[[800, 1600]], [0.4, -0.2], atol=1e-14)
    np.testing.assert_allclose(m.rate_ref[[0, 800, 1600]], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.gradient(m.theta_ref, m.time)[1:-1], m.rate_ref[1:-1], atol=1e-4)
    assert m.rest == pytest.approx(1.6) and m.goals.move == pytest.approx(-0.6)


def test_every_target_of_a_path_must_be_within_reach() -> None:
    with pytest.raises(UserError, match="beyond the wrist's range"):
        evaluated(kind="multi-step", angles_deg=(10.0, 60.0))
    with pytest.raises(UserError, match="beyond the range"):
        evaluated(kind="tip-path", tips=((0.078, 0.014), (0.0, 0.08)), inverse="closed-form")
    with pytest.raises(ValidationError, match="needs inverse"):
        Reference(kind="tip-path")


@pytest.mark.parametrize(
    "reference",
    [
        Reference(kind="step", angle_deg=25.0),
        Reference(tip=(0.078, 0.014), inverse="closed-form"),
        Reference(kind="sine", angle_deg=15.0),
        Reference(kind="multi-step", angles_deg=(20.0, -10.0, 5.0), duration=0.3),
        Reference(kind="tip-path", inverse="closed-form", duration=0.3),
    ],
    ids=lambda reference: reference.kind if reference.tip is None else "tip",
)
def test_a_mirrored_reference_is_the_same_motion_to_the_other_side(reference: Reference) -> None:
    one, other = (motion(each, WRIST, 1.5, 1e-3) for each in (reference, reference.mirrored()))
    for name in ("theta_ref", "rate_ref", "acceleration_ref", "theta_desired"):
        np.testing.assert_allclose(getattr(other, name), -getattr(one, name), atol=1e-12)
    np.testing.assert_allclose(other.tip_desired, one.tip_desired * [1.0, -1.0], atol=1e-15)
    assert other.goals.move == pytest.approx(-one.goals.move) and (other.begin, other.rest) == (one.begin, one.rest)
    assert reference.mirrored().mirrored() in (reference, reference.model_copy(update={"angle_deg": reference.end_deg}))


def test_a_motion_is_worked_out_once_and_cannot_be_changed() -> None:
    """Rollouts share it; another reference, wrist, horizon or period is another motion."""
    asked = Reference(angle_deg=20.0), WristParameters(), 1.0, 1e-3
    first = motion(*asked)
    assert motion(*asked) is first
    for array in (first.time, first.theta_ref, first.rate_ref, first.acceleration_ref, first.tip_desired):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    longer = WristParameters().model_copy(update={"length": 0.1})
    for other in ((Reference(angle_deg=21.0), *asked[1:]), (asked[0], longer, 1.0, 1e-3), (*asked[:2], 1.1, 1e-3)):
        assert motion(*other).tip_desired.tobytes() != first.tip_desired.tobytes()


def test_a_path_that_rests_in_between_is_what_its_samples_are_one_by_one() -> None:
    rng = np.random.default_rng(1)
    rows = np.repeat(rng.uniform(-0.6, 0.6, (6, 12)), rng.integers(1, 5, 12), axis=1)
    rows[3:] += 0.1
    rows[3, 20:] = 0.08  # the length alone changes
    together = arc_path(rows[:3], rows[3:])
    alone = [arc_path(rows[:3, k : k + 1], rows[3:, k : k + 1]) for k in range(rows.shape[1])]
    for name in ("position", "velocity", "acceleration"):
        parts = np.concatenate([getattr(each, name) for each in alone])
        np.testing.assert_allclose(getattr(together, name), parts, rtol=1e-14, atol=1e-15)
