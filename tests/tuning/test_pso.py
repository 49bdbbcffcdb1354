"""Particle swarm step by step: closed forms of single particles."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.tuning.optimisers.pso import ParticleSwarm

DIM = 2000
CONSTRICTION = 0.7298437881283576
"""2 / |2 - phi - sqrt(phi^2 - 4 phi)| with phi = 4.1 (Clerc and Kennedy, eq. 4)."""


def improving(steps: int, dim: int = DIM) -> tuple[ParticleSwarm, list[Array]]:
    """A particle alone that finds each place better than the last, and where it has been."""
    swarm = ParticleSwarm(dim, 1, np.full(dim, 0.5), np.random.default_rng(0))
    places = []
    for value in range(steps):
        places.append(swarm.ask()[0])
        swarm.tell(np.array([-float(value)]))
    return swarm, places


def test_a_particle_at_its_best_place_coasts_with_the_constriction() -> None:
    _, places = improving(6)
    steps = np.diff(places, axis=0)
    np.testing.assert_allclose(steps[1:], CONSTRICTION * steps[:-1], rtol=1e-9)


def test_a_particle_begins_with_any_speed_up_to_a_twentieth_of_the_box() -> None:
    _, places = improving(2)
    first = (places[1] - places[0]) / CONSTRICTION
    assert -0.05 <= first.min() < -0.0475 and 0.0475 < first.max() <= 0.05
    assert first.std() == pytest.approx(0.05 / np.sqrt(3.0), rel=0.05)


def test_a_particle_is_pulled_back_to_its_own_and_the_swarms_best() -> None:
    """By 2.05 times an even number each, here to the same place: triangular between 0 and 4.1."""
    swarm, places = improving(12)
    beyond = swarm.ask()[0]
    swarm.tell(np.array([1.0]))
    after = swarm.ask()[0]
    free = (np.minimum(beyond, after) > 0.0) & (np.maximum(beyond, after) < 1.0)
    best, coasted, pulled = places[-1][free], (beyond - places[-1])[free], (after - beyond)[free]
    pull = (pulled / CONSTRICTION - coasted) / (best - beyond[free])
    assert 0.0 <= pull.min() < 0.3 and 3.8 < pull.max() <= 4.1
    assert pull.mean() == pytest.approx(2.05, rel=0.03) and pull.std() == pytest.approx(2.05 / np.sqrt(6.0), rel=0.05)


def test_no_step_is_longer_than_a_twentieth_of_the_box_and_a_pull_from_far_is_as_long() -> None:
    swarm = ParticleSwarm(DIM, 3, np.zeros(DIM), np.random.default_rng(0))
    before = swarm.ask()
    swarm.tell(np.array([0.0, 1.0, 1.0]))
    steps = np.abs(swarm.ask() - before)
    assert steps.max() == pytest.approx(0.05) and (steps > 0.04999).mean() > 0.2


def test_each_particle_remembers_a_place_of_its_own() -> None:
    """Drawn by one random number to its own best and by another to the swarm's, the middle of the pulls is between."""
    swarm = ParticleSwarm(DIM, 2, np.full(DIM, 0.5), np.random.default_rng(1))
    own = swarm.ask()
    swarm.tell(np.array([0.0, 5.0]))
    away = swarm.ask()
    swarm.tell(np.array([1.0, 6.0]))
    moved = swarm.ask()[1] - away[1]
    near = np.abs(own[1] - own[0]) < 0.02
    wanted = CONSTRICTION * ((away[1] - own[1]) + 1.025 * (own[1] - away[1]) + 1.025 * (own[0] - away[1]))
    inside = near & (np.abs(moved) < 0.049)
    assert inside.sum() > 30
    assert np.corrcoef(moved[inside], wanted[inside])[0, 1] > 0.5
    far = (own[1] - own[0] > 0.1) & (own[1] - own[0] < 0.2) & (np.abs(away[1] - own[1]) < 0.03)
    assert (moved[far] < 0.0).mean() > 0.9, "what lies between its own and the swarm's best is pulled to the swarm's"


def test_a_particle_stops_at_a_wall() -> None:
    swarm = ParticleSwarm(DIM, 1, np.full(DIM, 0.99), np.random.default_rng(0))
    places = []
    for value in range(8):
        places.append(swarm.ask()[0])
        swarm.tell(np.array([-float(value)]))
    course = np.array(places)
    at_wall = course[2] == 1.0
    assert at_wall.mean() > 0.3
    assert (course[2:, at_wall] == 1.0).all(), "without speed, and where it is best, it stays"
    assert (np.diff(course[1:4, ~(course == 1.0).any(axis=0)], axis=0) != 0.0).all()


def test_the_worst_fifth_leaps_from_the_swarms_best_along_one_coordinate() -> None:
    swarm = ParticleSwarm(6, 10, np.full(6, 0.5), np.random.default_rng(0))
    leaps, coordinates = list[float](), set[int]()
    for _ in range(200):
        places = swarm.ask()
        swarm.own_values[:], swarm.best = np.inf, swarm.best._replace(point=np.full(6, 0.5), value=np.inf)
        swarm.tell(np.array([3.0, 1.0, 4.0, 9.0, 5.0, 2.0, 6.0, 8.0, 7.0, 0.0]))
        best, proposed = places[9], swarm.ask()
        apart = proposed != best
        assert (apart[[3, 7]].sum(axis=1) <= 1).all() and (apart[[0, 1, 2, 4, 5, 6, 8]].sum(axis=1) > 1).all()
        coordinates |= set(np.nonzero(apart[[3, 7]])[1].tolist())
        free = (best > 0.4) & (best < 0.6)
        leaps += [*(proposed - best)[[3, 7]][apart[[3, 7]] & free]]
    assert coordinates == set(range(6)) and len(leaps) > 50
    assert np.std(leaps) == pytest.approx(0.1, rel=0.25) and abs(np.mean(leaps)) < 0.03
