"""Samples and networks of a wrist that bends in two planes: they are those of one plane where a motion stays in it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.learning import DataSettings, NetworkSettings
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples, attitude, draw_equilibria, draw_samples, planes_of_samples, split_samples
from wristctl.learning.domain import Domain, arc_to
from wristctl.learning.evaluation import angle_errors, measures, places
from wristctl.learning.inference import Polynomial, compiled_exact, compiled_network, compiled_polynomial
from wristctl.learning.network_file import load_network, save_network
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Job, TrainingResult
from wristctl.simulation.planes import motion_in
from wristctl.wrist.kinematics import TipPath, arc_path
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips, tips_along

THREE = WristParameters(tendons="three")


def drawn(wrist: WristParameters = THREE, **settings: object) -> Samples:
    chosen = DataSettings.model_validate({"samples": 200, **settings})
    draw = draw_equilibria if chosen.source == "plant" else draw_samples
    return draw(chosen, wrist, np.random.default_rng(3))


@pytest.fixture(scope="module")
def samples() -> Samples:
    return drawn(samples=300)


@pytest.fixture(scope="module")
def trained(samples: Samples) -> TrainingResult:
    small = {"hidden": (8,), "epochs": 60}
    settings = NetworkSettings.model_validate({"preset": "recommended", **small})
    split = split_samples(len(samples.theta), 0.75, np.random.default_rng(5))
    return train_one(samples, Job("small", settings, split, np.random.SeedSequence(1)))


def test_planes_are_found_and_one_plane_is_refused_where_tendons_bend_in_two() -> None:
    assert planes_of_samples(DataSettings(), WristParameters()) == 1
    assert planes_of_samples(DataSettings(), WristParameters(gravity_flexion=3.0)) == 2
    assert planes_of_samples(DataSettings(planes=2), WristParameters(tendons="five")) == 2
    assert planes_of_samples(DataSettings(), THREE) == 2
    with pytest.raises(UserError, match=r"two planes, and the samples in one - gen-data\.planes"):
        planes_of_samples(DataSettings(planes=1), THREE)


@pytest.mark.parametrize("segments", [1, 4])
def test_bends_fill_their_disc_evenly(segments: int) -> None:
    found = drawn(samples=2000, segments=segments, stretch=(1.0, 1.0))
    bend = math.radians(THREE.range_deg)
    assert found.theta.shape == (2000, 2) and found.size.max() <= bend
    assert np.abs(found.theta.mean(axis=0)).max() < 0.02 * bend
    if segments == 1:
        assert np.mean(found.size < 0.5 * bend) == pytest.approx(0.25, abs=0.01), "a quarter of the area"
        np.testing.assert_allclose(spatial_tips(found.theta, THREE.length), found.tip, atol=1e-15)
        np.testing.assert_allclose(found.arc_length, THREE.length)


def test_equilibria_in_a_plane_are_those_of_the_planar_wrist() -> None:
    from wristctl.learning.dataset import _equilibria, _equilibria_in_space

    wrist, theta = WristParameters(), np.radians(np.linspace(-50.0, 50.0, 9))
    pose, hand, roll = np.full(9, 1.2), np.full(9, 0.35), np.zeros(9)
    tip, tension, stable = _equilibria(wrist, 4, theta, pose, roll, hand)
    bends = np.stack([theta, 0.0 * theta], axis=-1)
    tip_in_space, pull, held = _equilibria_in_space(wrist, 4, bends, pose, roll, hand)
    np.testing.assert_allclose(tip_in_space[:, :2], tip, atol=1e-12)
    np.testing.assert_allclose(tip_in_space[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(pull, tension, atol=1e-9)
    assert stable.all() and held.all()


def test_a_tendon_that_ends_within_a_segment_pulls_by_its_share() -> None:
    from wristctl.learning.dataset import _equilibria_in_space

    def pull(radius: float, **end: int) -> float:
        places = ({"angle_deg": 0.0, "radius": radius, **end}, {"angle_deg": 120.0}, {"angle_deg": 240.0})
        wrist = WristParameters.model_validate({"tendons": places, "pretension": 0.0})
        some = np.zeros(1)
        return float(_equilibria_in_space(wrist, 1, np.array([[0.05, 0.0]]), some, some, some + 0.3)[1][0])

    assert pull(0.02, ends_at=3) == pytest.approx(pull(0.01), rel=0.02)
    assert pull(0.02, ends_at=3) == pytest.approx(2.0 * pull(0.02), rel=0.02)
    short = {"angle_deg": 12.0, "ends_at": 3}, {"angle_deg": 130.0}, {"angle_deg": 250.0}
    found = drawn(WristParameters.model_validate({"tendons": short}), source="plant", poses=(0.0,))
    np.testing.assert_allclose(found.tip, spatial_tips(found.theta, THREE.length), atol=1e-12)


@pytest.mark.parametrize("tendons", ["three", "four", "five"])
def test_an_upright_wrist_has_no_direction_of_tilt(tendons: str) -> None:
    upright = drawn(WristParameters.model_validate({"tendons": tendons}), source="plant", planes=2, poses=(0.0,))
    rolled = drawn(
        WristParameters.model_validate({"tendons": tendons}), source="plant", planes=2, poses=(0.0,), rolls=(70.0,)
    )
    np.testing.assert_allclose(upright.tip, rolled.tip, atol=1e-12)
    assert upright.names == ("pose", "roll", "hand_mass")


def test_a_tilt_toward_flexion_bends_the_wrist_toward_flexion() -> None:
    found = drawn(source="plant", segments=4, poses=(90.0,), rolls=(90.0,))
    assert set(found.others[:, 1]) == {math.pi / 2}
    sag = found.tip - spatial_tips(found.theta, THREE.length)
    assert abs(sag[:, 2].mean()) > 10.0 * abs(sag[:, 1].mean()), "what gravity moves the tip of given bends by"


def test_the_bare_hand_in_a_pose_that_was_drawn_is_no_guess() -> None:
    found = drawn(source="plant", poses=(0.0, 60.0), rolls=(0.0, 90.0)).domain
    bare = THREE.hand_mass
    for pose, roll, mass in ((0.0, 0.0, bare), (math.radians(60.0), math.pi / 2, bare), (0.5, 0.3, 1.5 * bare)):
        assert not found.at(np.array([pose, roll, mass])).is_empty
    for pose, roll, mass in ((-0.1, 0.0, bare), (0.5, -0.1, bare), (0.5, 0.0, 1.6 * bare)):
        assert found.at(np.array([pose, roll, mass])).is_empty


def test_attitude_is_the_tilt_and_its_direction() -> None:
    for tilt, roll in ((0.4, 0.7), (-0.4, 0.7), (1.2, 0.0), (-1.2, 0.0), (0.9, math.pi / 2)):
        across = 9.81 * math.sin(tilt)
        gravity = (-9.81 * math.cos(tilt), across * math.cos(roll) if roll < 1.5 else 0.0)
        wrist = WristParameters(gravity=gravity, gravity_flexion=across * math.sin(roll))
        assert attitude(wrist) == pytest.approx((tilt, roll), abs=1e-12)


def test_samples_are_read_back_whole(samples: Samples) -> None:
    again = Samples.from_arrays(samples.arrays())
    np.testing.assert_array_equal(again.theta, samples.theta)
    assert again.domain == samples.domain and again.planes == 2 and samples.domain.planes == 2


def test_what_is_outside_of_two_planes_is_told() -> None:
    def tips(*bends_deg: tuple[float, float], length: float = 0.08) -> Array:
        return spatial_tips(np.radians(bends_deg), length)

    disc = Domain.disc(math.radians(40.0), (0.07, 0.09))
    assert list(disc.contains(tips((0.0, 0.0), (40.0, 0.0), (-28.0, 28.0)))) == [True, True, True]
    assert not disc.contains(tips((41.0, 0.0), (29.0, -29.0))).any()
    assert not disc.contains(tips((1.0, 0.0), length=0.095)).any()
    line = Domain.around(tips(*[(2.0 * k, k) for k in range(-15, 16)]), np.empty((31, 0)))
    assert list(line.contains(tips((20.0, 10.0), (10.0, 20.0), (-3.0, 8.0)))) == [True, False, False]
    assert line.at(np.empty(0)).planes == 2


def test_a_small_network_learns_both_planes_and_its_errors_are_norms(samples: Samples, trained: TrainingResult) -> None:
    network = trained.network
    assert network.sizes == (3, 8, 2) and network.planes == 2
    found = measures(trained, places(samples, trained.job.split))
    assert found["rmse_deg"] < 0.3 and found["workspace_rmse_deg"] < 0.3
    assert found["rmse_deg"] == pytest.approx(math.hypot(found["rmse_ulnar_deg"], found["rmse_flexion_deg"]))
    inputs = samples.inputs[:50]
    np.testing.assert_allclose(compiled_network(network)(inputs), network.angle(inputs), rtol=0, atol=1e-13)
    polynomial = Polynomial.fit(samples.inputs, samples.theta)
    assert np.degrees(np.abs(polynomial.angle(inputs) - samples.theta[:50]).max()) < 0.05
    np.testing.assert_allclose(compiled_polynomial(polynomial)(inputs), polynomial.angle(inputs), rtol=0, atol=1e-12)
    np.testing.assert_allclose(compiled_exact(samples.tip), samples.theta, rtol=0, atol=1e-12)


def test_the_loss_is_of_the_norm_over_both_planes(samples: Samples, trained: TrainingResult) -> None:
    rows = trained.job.split.validation
    error = trained.network.angle(samples.tip[rows]) - samples.theta[rows]
    assert trained.validation_loss == pytest.approx(float((error**2).sum(axis=1).mean()), rel=1e-9)
    off = angle_errors(samples.theta + np.radians([3.0, 4.0]), samples.theta, 2)
    assert (off.rmse_deg, off.rmse_ulnar_deg, off.rmse_flexion_deg) == pytest.approx((5.0, 3.0, 4.0))


def test_a_network_of_two_planes_is_kept_in_its_file(trained: TrainingResult, tmp_path: Path) -> None:
    file = tmp_path / "network.safetensors"
    save_network(trained.network, file, {})
    again = load_network(file)
    assert again.domain == trained.network.domain and again.planes == 2
    tip = spatial_tips(np.radians([[10.0, -20.0], [30.0, 5.0]]), 0.08)
    np.testing.assert_array_equal(again.angle(tip), trained.network.angle(tip))


def test_rates_along_a_path_are_derivatives_of_the_networks_bends(trained: TrainingResult) -> None:
    time = np.linspace(0.0, 1.0, 2001)
    path = tips_along(_circle(time), 0.08)
    found = trained.network.along(path)
    assert found.theta.shape == (2001, 2) and not found.outside.any()
    np.testing.assert_allclose(np.gradient(found.theta, time, axis=0)[1:-1], found.rate[1:-1], atol=1e-4)
    np.testing.assert_allclose(np.gradient(found.rate, time, axis=0)[1:-1], found.acceleration[1:-1], atol=2e-3)


def _circle(time: Array) -> Array:
    size, turn = math.radians(25.0), 2.0 * math.pi
    phase = np.array([turn * time, turn * time - 0.5 * math.pi])
    return np.stack([size * np.cos(phase), -turn * size * np.sin(phase), -(turn**2) * size * np.cos(phase)], axis=1)


def test_the_path_of_a_bend_in_a_plane_is_that_of_the_arc() -> None:
    theta = np.stack([np.linspace(-2.5, 2.5, 41), np.full(41, 0.7), np.linspace(-1.0, 2.0, 41)])
    length = np.repeat([[0.08], [0.0], [0.0]], 41, axis=1)
    toward = np.array([math.cos(0.6), math.sin(0.6)])
    found, planar = tips_along(toward[:, None, None] * theta, 0.08), arc_path(theta, length)
    for name in ("position", "velocity", "acceleration"):
        x, y = getattr(planar, name).T
        np.testing.assert_allclose(getattr(found, name), np.stack([x, *(toward[:, None] * y)], axis=1), atol=1e-14)


def test_a_network_behind_a_reference_is_followed_and_judged_by_what_is_wanted(trained: TrainingResult) -> None:
    reference = Reference.model_validate({"kind": "circumduction", "angle_deg": 20.0, "inverse": "network"})
    asked: list[TipPath] = []

    def inverse(path: TipPath) -> object:
        asked.append(path)
        return trained.network.along(path)

    found = motion_in(2, reference, None, THREE, 4.0, 0.01, inverse)  # type: ignore[arg-type]
    np.testing.assert_allclose(arc_to(asked[0].position)[0], found.theta_desired, atol=1e-12)
    np.testing.assert_allclose(trained.network.angle(found.tip_desired), found.theta_ref, atol=1e-12)
    off = np.degrees(np.abs(found.theta_ref - found.theta_desired).max())
    assert 0.0 < off < 1.0 and found.outside == 0.0
    far = Reference.model_validate({"kind": "circumduction", "angle_deg": 49.0, "inverse": "network"})
    longer = THREE.model_copy(update={"length": 0.1})
    assert motion_in(2, far, None, longer, 4.0, 0.01, trained.network.along).outside == 1.0
    with pytest.raises(UserError, match="goes through a network, and none is given"):
        motion_in(2, reference, None, THREE, 4.0, 0.01)
