from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.config.errors import UserError
from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.dataset import Samples, draw_samples, split_samples
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
