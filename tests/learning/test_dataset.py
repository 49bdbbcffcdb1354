from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples, draw_samples, split_samples, unit_cube
from wristctl.wrist.kinematics import arc_tip, exact_angle

SAMPLINGS = ("uniform", "latin-hypercube", "sobol")
WRIST = WristParameters()


def draw(seed: int = 3, **settings: object) -> Samples:
    return draw_samples(DataSettings.model_validate(settings), WRIST, np.random.default_rng(seed))


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_samples_fill_the_angle_and_stretch_range(sampling: str) -> None:
    samples = draw(sampling=sampling, samples=1000)
    bend, (low, high) = math.radians(50.0), (0.9 * WRIST.length, 1.1 * WRIST.length)
    counts, _, _ = np.histogram2d(samples.theta, samples.arc_length, bins=6, range=[(-bend, bend), (low, high)])
    assert counts.sum() == 1000, "a sample lies outside the range"
    assert counts.min() > 0.4 * 1000 / 36


def test_sobol_covers_more_evenly_than_chance() -> None:
    def spread(sampling: str) -> float:
        samples = draw(sampling=sampling, samples=1000)
        return float(np.histogram2d(samples.theta, samples.arc_length, bins=6)[0].std())

    assert spread("sobol") < 0.3 * spread("uniform")


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_samples_are_the_same_for_the_same_seed_only(sampling: str) -> None:
    assert draw(sampling=sampling).theta.tobytes() == draw(sampling=sampling).theta.tobytes()
    assert draw(sampling=sampling).theta.tobytes() != draw(sampling=sampling, seed=4).theta.tobytes()


def test_exact_inverse_finds_the_sampled_angle_whatever_the_stretch() -> None:
    samples = draw(stretch=(0.5, 1.5))
    np.testing.assert_allclose(exact_angle(samples.tip), samples.theta, rtol=0.0, atol=1e-15)


def test_every_sample_and_the_corners_lie_in_the_domain_but_nothing_beyond() -> None:
    samples = draw(sampling="uniform")
    (left, right), (short, long) = samples.domain.theta, samples.domain.arc_length
    corners = arc_tip(np.array([left, left, right, right]), np.array([short, long, short, long]))
    beyond = arc_tip(np.array([left - 1e-6, right + 1e-6, 0.0, 0.0]), np.array([0.08, 0.08, short - 1e-6, long + 1e-6]))
    assert samples.domain.contains(samples.tip).all()
    assert samples.domain.contains(corners).all()
    assert not samples.domain.contains(beyond).any()
    assert not samples.domain.contains(np.array([[np.nan, 0.0], [-0.08, 0.0], [0.0, 0.0], [np.inf, 0.0]])).any()


def test_samples_without_stretch_stay_on_one_arc_length() -> None:
    samples = draw(stretch=(1.0, 1.0))
    assert np.all(samples.arc_length == WRIST.length)
    assert samples.domain.contains(samples.tip).all()


def test_samples_survive_the_way_through_arrays() -> None:
    samples = draw()
    back = Samples.from_arrays(samples.arrays())
    assert back.domain == samples.domain
    assert back.tip.tobytes() == samples.tip.tobytes() and back.theta.tobytes() == samples.theta.tobytes()


def test_split_is_the_papers_and_uses_every_sample_once() -> None:
    split = split_samples(1000, 0.75, np.random.default_rng(0))
    assert (len(split.train), len(split.validation), len(split.test)) == (750, 125, 125)
    assert sorted([*split.train, *split.validation, *split.test]) == list(range(1000))


def test_split_without_samples_to_validate_on_is_the_users_error() -> None:
    with pytest.raises(UserError, match="train_share"):
        split_samples(10, 0.9, np.random.default_rng(0))


def test_a_chain_of_segments_shares_the_angle_and_its_samples_fill_the_wrists_range() -> None:
    """Four segments bend within a quarter of the range each, so that the sum lies within it, less often at its ends."""
    samples = draw(segments=4, samples=2000, sampling="uniform", stretch=(0.8, 1.3))
    bend = math.radians(WRIST.range_deg)
    assert np.abs(samples.theta).max() <= bend and samples.theta.std() == pytest.approx(
        bend / math.sqrt(12.0), rel=0.05
    )
    assert samples.theta.mean() == pytest.approx(0.0, abs=0.03)
    np.testing.assert_allclose(np.linalg.norm(samples.tip, axis=1) / WRIST.length, 1.05, atol=0.3)
    assert not samples.curvature_is_constant and samples.segments == 4
    assert draw(segments=1).curvature_is_constant and draw(segments=1).segments == 1
    assert samples.domain.contains(samples.tip).all()


def test_stretch_is_a_share_of_the_wrists_length() -> None:
    samples = draw(stretch=(0.5, 1.5), samples=500)
    low, high = samples.domain.arc_length
    assert (low, high) == pytest.approx((0.5 * WRIST.length, 1.5 * WRIST.length))
    assert samples.domain.theta == pytest.approx((-math.radians(50.0), math.radians(50.0)))
    assert samples.arc_length.mean() == pytest.approx(WRIST.length, rel=0.03)
    np.testing.assert_allclose(samples.tip, arc_tip(samples.theta, samples.arc_length))


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_as_many_samples_as_asked_for_in_every_dimension(sampling: str) -> None:
    for count in (10, 64, 65, 100):
        points = unit_cube(sampling, count, 3, np.random.default_rng(0))
        assert points.shape == (count, 3) and points.min() >= 0.0 and points.max() < 1.0
        assert len(np.unique(points, axis=0)) == count


def test_a_latin_hypercube_has_one_sample_in_every_row_and_column() -> None:
    points = unit_cube("latin-hypercube", 40, 3, np.random.default_rng(0))
    np.testing.assert_array_equal(np.sort((40 * points).astype(int), axis=0), np.arange(40)[:, None].repeat(3, axis=1))


def test_what_is_held_out_is_the_test_and_the_rest_is_for_validation() -> None:
    held = np.zeros(100, np.int64)
    held[40:60] = 1
    split = split_samples(100, 0.75, np.random.default_rng(0), held)
    assert (len(split.train), len(split.validation)) == (60, 20) and sorted(split.test) == list(range(40, 60))
    assert sorted([*split.train, *split.validation]) == [*range(40), *range(60, 100)]
    nothing = split_samples(100, 0.75, np.random.default_rng(0), np.zeros(100, np.int64))
    assert (len(nothing.train), len(nothing.validation), len(nothing.test)) == (75, 12, 13)


def test_two_samples_to_validate_on_are_the_fewest() -> None:
    split = split_samples(16, 0.75, np.random.default_rng(0))
    assert (len(split.train), len(split.validation), len(split.test)) == (12, 2, 2)
    with pytest.raises(UserError, match="leave 1 for validation"):
        split_samples(12, 0.75, np.random.default_rng(0))
    assert len(split_samples(8, 0.01, np.random.default_rng(0)).train) == 1


@pytest.mark.parametrize(("count", "share"), [(3, 0.75), (4, 0.9), (20, 0.75), (7, 0.01)])
def test_whole_recordings_are_split_and_each_part_has_one(count: int, share: float) -> None:
    rng = np.random.default_rng(1)
    recording = rng.permutation(np.repeat(np.arange(count), rng.integers(2, 40, count)))
    split = split_samples(len(recording), share, rng, None, recording)
    parts = [set(recording[rows].tolist()) for rows in (split.train, split.validation, split.test)]
    assert all(parts) and sum(map(len, parts)) == count == len(set().union(*parts))
    assert len(parts[0]) == min(max(1, round(share * count)), count - 2) and abs(len(parts[1]) - len(parts[2])) <= 1
    assert sorted(np.concatenate([split.train, split.validation, split.test])) == list(range(len(recording)))


def test_two_recordings_cannot_train_choose_and_judge() -> None:
    for recording, told in (([0, 0, 1, 1], "2 recordings: training"), ([5, 5, 5, 5], "1 recording: training")):
        with pytest.raises(UserError, match=told) as caught:
            split_samples(4, 0.5, np.random.default_rng(0), None, np.array(recording))
        assert "split: sample" in caught.value.fix
    with pytest.raises(UserError, match="a recording with a single sample"):
        split_samples(5, 0.5, np.random.default_rng(0), None, np.array([0, 0, 1, 1, 2]))
