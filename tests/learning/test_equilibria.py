"""Samples of the loaded wrist: each is at rest in its own pose with its own payload, and poses come in turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, KEPT, Samples, draw_equilibria
from wristctl.wrist.kinematics import chain_tip, exact_arc
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import equilibria_at

WRIST = WristParameters()
HANGING = {"source": "plant", "segments": 4, "samples": 240, "poses": (180.0, 120.0), "held_out_poses": (150.0, 90.0)}


def drawn(wrist: WristParameters = WRIST, **changes: object) -> Samples:
    settings = DataSettings.model_validate(HANGING | {"payload": (0.1, 0.5)} | changes)
    return draw_equilibria(settings, wrist, np.random.default_rng(0))


@pytest.fixture(scope="module")
def hanging() -> Samples:
    return drawn()


def test_each_sample_is_at_rest_in_its_pose_with_its_payload(hanging: Samples) -> None:
    """Tilted from upright toward +y, so that gravity has a part along the base and one across."""
    for at in range(0, 240, 17):
        pose, hand = hanging.others[at]
        gravity = (-9.81 * math.cos(pose), 9.81 * math.sin(pose))
        own = WRIST.model_copy(update={"gravity": gravity, "hand_mass": hand})
        found = equilibria_at(segments(own, 4)[None], 4, hanging.theta[at : at + 1], 2.0 * WRIST.pretension)
        assert found.stable.all()
        np.testing.assert_allclose(hanging.tip[at], chain_tip(found.theta, WRIST.length)[0], atol=1e-9)


def test_angles_fill_the_range_and_payloads_theirs_whatever_the_pose(hanging: Samples) -> None:
    bend, payload = math.radians(WRIST.range_deg), hanging.others[:, 1] / WRIST.hand_mass - 1.0
    assert len(hanging.theta) == 240, "hanging, nothing buckles"
    assert -bend <= hanging.theta.min() < -0.97 * bend and 0.97 * bend < hanging.theta.max() <= bend
    assert 0.1 <= payload.min() < 0.11 and 0.49 < payload.max() <= 0.5
    assert abs(np.corrcoef(hanging.theta, payload)[0, 1]) < 0.1
    np.testing.assert_allclose(np.degrees(hanging.others[:, 0]), np.tile([180.0, 120.0, 150.0, 90.0], 60))
    np.testing.assert_allclose(hanging.arc_length, exact_arc(hanging.tip)[1])
    assert hanging.names == ("pose", "hand_mass") and hanging.segments == 4


def test_what_is_held_out_is_told_by_its_reason_the_pose_first(hanging: Samples) -> None:
    pose, payload = np.degrees(hanging.others[:, 0]), hanging.others[:, 1] / WRIST.hand_mass - 1.0
    apart = np.isin(np.round(pose), (150.0, 90.0))
    np.testing.assert_array_equal(hanging.held_out == HELD_POSE, apart)
    middle = (payload >= 0.2) & (payload <= 0.3) & ~apart
    np.testing.assert_array_equal(hanging.held_out == HELD_PAYLOAD, middle)
    assert middle.any() and (hanging.held_out[~apart & ~middle] == KEPT).all()
    (low, high), (least, most) = hanging.domain.others
    assert np.degrees([low, high]) == pytest.approx([120.0, 180.0]), "held-out poses lie outside the domain"
    assert (least, most) == (hanging.others[~apart, 1].min(), hanging.others[~apart, 1].max())
    assert hanging.domain.contains(hanging.inputs[~apart]).all()


def test_ends_of_the_held_out_payload_are_held_out() -> None:
    for ends, code in (
        ((0.2, 0.3), HELD_PAYLOAD),
        ((0.1, 0.2), HELD_PAYLOAD),
        ((0.21, 0.3), KEPT),
        ((0.1, 0.19), KEPT),
    ):
        found = drawn(payload=(0.2, 0.2), held_out_payload=ends, held_out_poses=(), samples=10)
        assert set(found.held_out.tolist()) == {code}


def test_what_the_tendons_cannot_hold_is_left_out() -> None:
    """Those that need more than the limit, which is one tendon's."""
    weak = WRIST.model_copy(update={"tension_limit": 16.0})
    kept, found = drawn(weak), drawn()
    rows = np.array([segments(WRIST.model_copy(update={
        "gravity": (-9.81 * math.cos(pose), 9.81 * math.sin(pose)), "hand_mass": hand}), 4)
        for pose, hand in found.others])  # fmt: skip
    most = equilibria_at(rows, 4, found.theta, 2.0 * WRIST.pretension).pulls.max(axis=1) / 2.0
    assert 120 < (most <= 16.0).sum() < 240
    np.testing.assert_array_equal(kept.theta, found.theta[most <= 16.0])
    np.testing.assert_array_equal(kept.held_out, found.held_out[most <= 16.0])
    half = np.sort(most)[119:121]
    assert len(drawn(WRIST.model_copy(update={"tension_limit": float(half.mean())})).theta) == 120, "half is enough"
    with pytest.raises(UserError, match="121 of 240"):
        drawn(WRIST.model_copy(update={"tension_limit": float(half[0]) - 1e-6}))


def test_the_tips_alone_are_the_same_samples_without_the_other_inputs(hanging: Samples) -> None:
    alone = hanging.tips_alone()
    np.testing.assert_array_equal(alone.inputs, hanging.tip)
    np.testing.assert_array_equal(hanging.inputs, np.hstack([hanging.tip, hanging.others]))
    np.testing.assert_array_equal(alone.theta, hanging.theta)
    assert (alone.names, alone.others.shape, alone.segments) == ((), (240, 0), 4)
    assert alone.domain.others == () and alone.domain.theta == hanging.domain.theta
    assert alone.domain.contains(hanging.tip[hanging.held_out != HELD_POSE]).all()
