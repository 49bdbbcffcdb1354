"""Differential evolution step by step: what a trial is made of, and what takes its member's place."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.tuning.optimisers.differential_evolution import DifferentialEvolution

DIM = 400


def begun(seed: int, candidates: int = 3, dim: int = DIM) -> tuple[DifferentialEvolution, Array, Array]:
    """An optimiser that has been told its first population, of which member 1 is the best: it, the trials to come."""
    optimiser = DifferentialEvolution(dim, candidates, np.full(dim, 0.5), np.random.default_rng(seed))
    population = optimiser.ask()
    optimiser.tell(np.where(np.arange(candidates) == 1, 0.0, 1.0))
    return optimiser, population, optimiser.ask()


def weights(seed: int) -> list[float]:
    """What each of three trials weighs the difference of the two other members with, where no wall is near."""
    _, population, trials = begun(seed)
    found = []
    for member, trial in enumerate(trials):
        one, other = (population[(member + k) % 3] for k in (1, 2))
        free = (trial != population[member]) & (np.abs(population[1] - 0.5) + np.abs(one - other) < 0.5)
        ratios = ((trial - population[1]) / (one - other))[free]
        assert len(ratios) > 10 and ratios == pytest.approx(ratios[0], rel=1e-6)
        found.append(float(ratios[0]))
    return found


def test_a_mutant_is_the_best_and_a_dithered_difference_of_two_others() -> None:
    drawn = np.array([weights(seed) for seed in range(40)])
    sizes = np.abs(drawn)
    np.testing.assert_allclose(sizes, sizes[:, :1].repeat(3, axis=1), rtol=1e-6, err_msg="one weight a generation")
    assert 0.5 <= sizes.min() < 0.6 and 0.9 < sizes.max() <= 1.0
    assert (drawn > 0.0).any(axis=0).all() and (drawn < 0.0).any(axis=0).all(), "either of them comes first"


def test_seven_of_ten_coordinates_are_the_mutants_and_one_at_least() -> None:
    shares = []
    for seed in range(10):
        _, population, trials = begun(seed, candidates=5)
        shares.append(float((trials != population).mean()))
    assert np.mean(shares) == pytest.approx(0.7, abs=0.02)
    for seed in range(30):
        _, population, trials = begun(seed, candidates=6, dim=1 + seed % 2)
        assert (trials != population).any(axis=1).all()


def test_beyond_a_wall_a_coordinate_lies_between_the_best_and_the_wall() -> None:
    bounced = []
    for seed in range(5):
        _, population, trials = begun(seed)
        best = population[1]
        for member, trial in enumerate(trials):
            one, other = (population[(member + k) % 3] for k in (1, 2))
            near = (best < 0.05) & (np.abs(one - other) > 0.3) & (trial != population[member]) & (trial < best)
            bounced += [*(trial / best)[near]]
    assert len(bounced) > 15 and 0.0 <= min(bounced) < 0.3 and 0.7 < max(bounced) < 1.0


def test_a_trial_that_is_no_worse_takes_its_members_place_and_a_worse_one_does_not() -> None:
    optimiser, population, trials = begun(0, candidates=4)
    optimiser.tell(np.array([1.0, 0.5, 0.9, 2.0]))  # equal, worse, better, worse
    now = np.where(np.array([True, False, True, False])[:, None], trials, population)
    kept = (optimiser.ask() == now).mean(axis=1)
    assert kept == pytest.approx(0.3, abs=0.1), "what is not the mutant's is the member's"


def test_other_members_than_its_own_make_up_a_difference() -> None:
    """With a member of its own line far off, no trial of that member is moved by it but through the crossover."""
    for seed in range(20):
        _, population, trials = begun(seed, candidates=4, dim=60)
        for member, trial in enumerate(trials):
            crossed = trial != population[member]
            moves = trial - population[1]
            others = [population[k] for k in range(4) if k != member]
            fits = [
                np.ptp((moves / (one - other))[crossed & (np.abs(population[1] - 0.5) + np.abs(one - other) < 0.5)])
                for one in others for other in others if one is not other
            ]  # fmt: skip
            assert min(fits) < 1e-9
