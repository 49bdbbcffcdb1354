from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, KEPT, Samples, draw_equilibria, split_samples
from wristctl.wrist.kinematics import chain_tip, exact_angle
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import equilibria_at, equilibrium

WRIST = WristParameters()
SETTINGS = DataSettings(
    source="plant", segments=4, samples=400, poses=(0.0, 90.0, 180.0), held_out_poses=(45.0,), payload=(0.0, 0.5)
)


@pytest.fixture(scope="module")
def drawn() -> Samples:
    return draw_equilibria(SETTINGS, WRIST, np.random.default_rng(0))


def test_an_equilibrium_at_an_angle_is_the_equilibrium_under_its_tensions() -> None:
    angle = np.array([-0.6, 0.0, 0.3, 0.8])
    found = equilibria_at(np.tile(segments(WRIST, 4), (4, 1)), 4, angle, 2.0 * WRIST.pretension)
    assert found.stable.all()
    np.testing.assert_allclose(found.theta.sum(axis=1), angle, rtol=0, atol=1e-12)
    for theta, (plus, minus) in zip(found.theta, found.pulls, strict=True):
        np.testing.assert_allclose(equilibrium(WRIST, 4, (plus / 2.0, minus / 2.0)), theta, rtol=0, atol=1e-9)


def test_a_load_that_buckles_the_wrist_is_told_from_one_that_does_not() -> None:
    rows = np.stack([segments(WRIST.model_copy(update={"hand_mass": mass}), 4) for mass in (0.3, 1.5)])
    assert equilibria_at(rows, 4, np.array([0.1, 0.1]), 4.0).stable.tolist() == [True, False]


def test_one_segment_bends_in_an_arc_and_four_do_not(drawn: Samples) -> None:
    one = draw_equilibria(SETTINGS.model_copy(update={"segments": 1, "samples": 50}), WRIST, np.random.default_rng(0))
    assert np.abs(exact_angle(one.tip) - one.theta).max() < 1e-9
    assert np.degrees(np.abs(exact_angle(drawn.tip) - drawn.theta)).max() > 3.0 and not drawn.curvature_is_constant


def test_held_out_poses_and_payloads_are_judged_by_and_never_trained_on(drawn: Samples) -> None:
    split = split_samples(len(drawn.theta), 0.8, np.random.default_rng(0), drawn.held_out)
    pose, load = np.degrees(drawn.others[:, 0]), drawn.others[:, 1] / WRIST.hand_mass - 1.0
    held = (np.abs(pose - 45.0) < 1e-9) | ((load >= 0.2) & (load <= 0.3))
    assert set(split.test) == set(np.flatnonzero(held))
    assert {KEPT, HELD_PAYLOAD, HELD_POSE} == set(drawn.held_out.tolist())
    assert len(split.train) + len(split.validation) + len(split.test) == len(drawn.theta)


def test_samples_of_the_plant_read_back_without_loss(drawn: Samples) -> None:
    back = Samples.from_arrays(drawn.arrays())
    assert back.inputs.tobytes() == drawn.inputs.tobytes() and back.domain == drawn.domain
    assert back.names == ("pose", "hand_mass") and back.segments == 4
    assert (back.held_out == drawn.held_out).all()


def test_a_load_that_buckles_most_of_the_time_is_the_users_error() -> None:
    heavy = WRIST.model_copy(update={"hand_mass": 3.0})
    upright = SETTINGS.model_copy(update={"poses": (0.0,), "held_out_poses": ()})
    with pytest.raises(UserError, match="buckle"):
        draw_equilibria(upright, heavy, np.random.default_rng(0))


def test_tip_of_a_chain_of_equal_angles_is_that_of_one_arc() -> None:
    tip = chain_tip(np.full((1, 4), 0.2), 0.08)
    assert exact_angle(tip)[0] == pytest.approx(0.8, abs=1e-12)
