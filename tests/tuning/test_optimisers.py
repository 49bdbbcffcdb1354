"""Every optimiser of the table, held to the same tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.config.control import TuneSettings
from wristctl.config.errors import UserError
from wristctl.tuning.optimisers import OPTIMISERS, Optimiser
from wristctl.tuning.optimisers.pso import ParticleSwarm

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]

NAMES = list(OPTIMISERS)
every = pytest.mark.parametrize("name", NAMES)
learning = pytest.mark.parametrize("name", [name for name in NAMES if name != "random"])


def sphere(unit: Array) -> Array:
    return ((unit - 0.7) ** 2).sum(axis=-1)


def rosenbrock(unit: Array) -> Array:
    x = 4.0 * unit - 2.0
    return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=-1)


def corner(unit: Array) -> Array:
    return unit.sum(axis=-1)


def start(name: str, dim: int = 3, candidates: int = 20, seed: int = 0) -> Optimiser:
    return OPTIMISERS[name](dim, candidates, np.full(dim, 0.5), np.random.default_rng(seed))


def course(optimiser: Optimiser, objective: Objective, iterations: int) -> tuple[Array, Array]:
    """Candidates (I, P, dim) and values (I, P) of a whole search."""
    asked, values = [], []
    for _ in range(iterations):
        asked.append(optimiser.ask())
        values.append(objective(asked[-1]))
        optimiser.tell(values[-1])
    return np.array(asked), np.array(values)


def median_best(name: str, objective: Objective, iterations: int, seeds: int = 15) -> float:
    return float(np.median([course(start(name, seed=s), objective, iterations)[1].min() for s in range(seeds)]))


def test_table_offers_what_a_study_may_name() -> None:
    for name in NAMES:
        assert TuneSettings.model_validate({"optimiser": name}).optimiser == name


@every
def test_first_candidates_hold_the_start(name: str) -> None:
    middle = np.array([0.5, 0.25, 1.0])
    optimiser = OPTIMISERS[name](3, 6, middle, np.random.default_rng(0))
    assert np.array_equal(optimiser.ask()[0], middle)


@every
@pytest.mark.parametrize("objective", [sphere, corner, rosenbrock])
def test_candidates_stay_in_the_unit_box(name: str, objective: Objective) -> None:
    asked, _ = course(start(name), objective, 40)
    assert asked.shape == (40, 20, 3) and asked.min() >= 0.0 and asked.max() <= 1.0


@every
def test_same_seed_same_bytes_and_another_seed_another_course(name: str) -> None:
    first, second, other = (course(start(name, seed=s), rosenbrock, 15)[0] for s in (3, 3, 4))
    assert first.tobytes() == second.tobytes()
    assert first[1:].tobytes() != other[1:].tobytes()


@every
def test_best_is_the_least_value_ever_told_at_its_point(name: str) -> None:
    optimiser = start(name)
    asked, values = course(optimiser, rosenbrock, 12)
    at = np.unravel_index(values.argmin(), values.shape)
    assert optimiser.best.value == values.min()
    assert np.array_equal(optimiser.best.point, asked[at])


@every
def test_repeated_ask_gives_the_same_candidates_and_callers_cannot_spoil_them(name: str) -> None:
    optimiser = start(name)
    first = optimiser.ask()
    first_values = sphere(first)
    kept = first.copy()
    first[:] = 9.0
    assert np.array_equal(optimiser.ask(), kept)
    optimiser.tell(first_values)
    assert optimiser.best.point.max() <= 1.0


@every
def test_tell_without_ask_or_with_a_wrong_count_is_refused(name: str) -> None:
    optimiser = start(name)
    with pytest.raises(RuntimeError, match="ask"):
        optimiser.tell(np.zeros(20))
    optimiser.ask()
    with pytest.raises(ValueError, match="20 values"):
        optimiser.tell(np.zeros(3))
    optimiser.tell(np.zeros(20))
    with pytest.raises(RuntimeError, match="ask"):
        optimiser.tell(np.zeros(20))


@every
def test_start_outside_the_box_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="unit box"):
        OPTIMISERS[name](2, 5, np.array([0.5, 1.5]), np.random.default_rng(0))


@every
@pytest.mark.parametrize("failure", [np.inf, np.nan])
def test_failed_candidates_are_never_the_best_and_stop_nothing(name: str, failure: float) -> None:
    def half_fails(unit: Array) -> Array:
        return np.where(unit[:, 0] < 0.5, failure, sphere(unit))

    optimiser = start(name)
    asked, _ = course(optimiser, half_fails, 40)
    assert np.isfinite(asked).all()
    assert optimiser.best.point[0] >= 0.5 and optimiser.best.value < 0.01


@every
def test_search_goes_on_where_every_candidate_fails(name: str) -> None:
    optimiser = start(name)
    asked, _ = course(optimiser, lambda unit: np.full(len(unit), np.nan), 10)
    assert optimiser.best.value == np.inf
    assert len(np.unique(asked.reshape(-1, 3), axis=0)) > 100


@learning
def test_sphere_is_solved(name: str) -> None:
    assert median_best(name, sphere, 40) < 1e-5


@learning
def test_optimum_in_a_corner_is_met(name: str) -> None:
    assert median_best(name, corner, 40) < 1e-6


@learning
def test_rosenbrock_is_solved_better_than_by_random_search(name: str) -> None:
    assert median_best(name, rosenbrock, 30) < 0.5 * median_best("random", rosenbrock, 30)


def test_differential_evolution_says_how_many_candidates_it_needs() -> None:
    with pytest.raises(UserError, match="at least 3"):
        start("differential-evolution", candidates=2)


@every
def test_without_candidates_nothing_is_searched(name: str) -> None:
    with pytest.raises(UserError, match="candidates, not 0"):
        start(name, candidates=0)


def test_swarm_with_one_dimension_and_one_candidate_runs() -> None:
    asked, _ = course(ParticleSwarm(1, 1, np.array([0.5]), np.random.default_rng(0)), sphere, 5)
    assert asked.shape == (5, 1, 1)


def test_swarm_is_as_good_as_an_independent_one_on_rosenbrock() -> None:
    pytest.importorskip("pymoo")
    from pymoo.algorithms.soo.nonconvex.pso import PSO
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Valley(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            out["F"] = rosenbrock(x)

    problem = Valley(n_var=3, n_obj=1, xl=0.0, xu=1.0)
    theirs = [float(minimize(problem, PSO(pop_size=20), ("n_gen", 30), seed=s).F[0]) for s in range(7)]
    ours = median_best("pso", rosenbrock, 30)
    assert ours < 3.0 * float(np.median(theirs))
