"""References: angles, tip paths, and their derivatives."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.domain import Domain
from wristctl.learning.network import Network, Scaler
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.motion import Motion
from wristctl.simulation.reference import motion, reference_name
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


@given(st.floats(-0.8, 0.8), st.floats(0.0793, 0.0807), st.sampled_from(["step", "minimum-jerk", "sine"]))
@pytest.mark.slow
def test_the_wanted_angle_is_the_closed_form_inverse_of_the_wanted_tip(angle: float, length: float, kind: str) -> None:
    x, y = (float(v) for v in arc_tip(np.array(angle), length))
    m = evaluated(kind=kind, tip=(x, y), inverse="closed-form", duration=0.7, frequency=0.8)
    np.testing.assert_allclose(exact_arc(m.tip_desired)[0], m.theta_ref, rtol=0.0, atol=1e-15)


def test_a_tip_target_is_reached_and_its_stretch_is_kept() -> None:
    tip = arc_tip(np.array(0.4), 0.0806)
    m = evaluated(tip=tuple(float(v) for v in tip), inverse="closed-form")
    assert m.final == pytest.approx(0.4, abs=1e-14)
    np.testing.assert_allclose(m.tip_desired[-1], tip, atol=1e-16)
    np.testing.assert_allclose(m.tip_desired[0], [WRIST.length, 0.0], atol=1e-16)
    np.testing.assert_allclose(exact_arc(m.tip_desired[-1]), [0.4, 0.0806], rtol=1e-13)


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
    tips = tuple(tuple(float(v) for v in arc_tip(np.array(a), r)) for a, r in ((0.4, 0.0805), (-0.2, 0.0797)))
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


@pytest.mark.parametrize("inverse", ["closed-form", "network"])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("length", [0.0808, 0.0793])
def test_a_tip_is_refused_farther_than_a_hundredth_of_the_length_from_what_an_arc_reaches(
    length: float, side: float, inverse: str
) -> None:
    """A longer wrist does not reach the same tip, nor does a shorter one; the last of several tips counts as well."""
    wrist = WristParameters(length=length)
    on, off = (arc_tip(np.array(side * 0.5), each) for each in (length, length + np.sign(0.08 - length) * 0.0009))
    near = Reference(tip=tuple(arc_tip(np.array(side * 0.5), 0.08)), inverse="closed-form")
    assert motion(near, wrist, 2.0, 0.1).final == pytest.approx(side * 0.5)
    tips = tuple(on.tolist()), tuple(off.tolist())
    for asked in (Reference(tip=tips[1], inverse=inverse), Reference(kind="tip-path", tips=tips, inverse=inverse)):  # type: ignore[arg-type]
        with pytest.raises(UserError) as refused:
            motion(asked, wrist, 1.0, 0.1, lambda path: pytest.fail("evaluated"))
        assert refused.value.where == ("reference.tips" if asked.tip is None else "reference.tip")
        named = np.array(re.findall(r"-?0\.\d{5}", refused.value.fix), np.float64)
        curve = arc_tip(np.linspace(-0.87, 0.87, 20_001), length)
        assert np.hypot(*(named - off)) == pytest.approx(np.hypot(*(curve - off).T).min(), abs=1e-5)
        assert exact_arc(named)[1] == pytest.approx(length, abs=1e-5)


def test_the_nearest_tip_to_one_beyond_the_range_is_at_its_end() -> None:
    with pytest.raises(UserError) as refused:
        evaluated(tip=(0.02, -0.06), inverse="closed-form")
    named = np.array(re.findall(r"-?0\.\d{5}", refused.value.fix), np.float64)
    np.testing.assert_allclose(named, arc_tip(np.array(-np.deg2rad(50.0)), 0.08), atol=1e-5)


def test_a_tip_path_without_tips_is_one_of_wrists_of_any_length() -> None:
    """And on the default wrist that of millimetres, to the last bit, with the noise of that name."""
    path = Reference(kind="tip-path", inverse="closed-form")
    metres = Reference(
        kind="tip-path", inverse="closed-form", tips=((0.078, 0.014), (0.076, 0.021), (0.079, -0.010), (0.076, 0.021))
    )
    for ours, theirs in ((path, metres), (path.mirrored(), metres.mirrored())):
        assert ours.in_metres(0.08).tips == theirs.tips and theirs.in_metres(0.12) is theirs
        assert scenario_of(ours, "ulnar") == scenario_of(theirs, "ulnar")
        known = motion(theirs, WRIST, 4.0, 1e-2)
        assert motion(ours, WRIST, 4.0, 1e-2).theta_ref.tobytes() == known.theta_ref.tobytes()
        for length in (0.03, 0.12):
            scaled = motion(ours, WristParameters(length=length), 4.0, 1e-2)
            np.testing.assert_allclose(scaled.theta_ref, known.theta_ref, atol=1e-14)
            np.testing.assert_allclose(scaled.tip_desired / length, known.tip_desired / 0.08, atol=1e-14)
            with pytest.raises(UserError, match="where an arc"):
                motion(theirs, WristParameters(length=length), 4.0, 1e-2)
    other = Reference(kind="tip-path", inverse="closed-form", tip_ratios=((0.97, -0.2), (0.99, 0.1)))
    np.testing.assert_allclose(
        motion(other, WristParameters(length=0.1), 2.0, 1e-3).tip_desired[[1000, -1]],
        [[0.097, -0.02], [0.099, 0.01]], atol=1e-8,
    )  # fmt: skip
    assert len({reference_name(each) for each in (path, path.mirrored(), metres, other)}) == 4
    with pytest.raises(ValidationError, match="not both"):
        Reference(kind="tip-path", inverse="closed-form", tips=((0.08, 0.0),), tip_ratios=((1.0, 0.0),))


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
    twice, same = (each.in_metres(0.08) for each in (reference.mirrored().mirrored(), reference))
    assert twice in (same, same.model_copy(update={"angle_deg": reference.end_deg}))


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
