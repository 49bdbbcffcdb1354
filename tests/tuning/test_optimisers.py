"""Every optimiser of the table, held to the same tests."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu

from wristctl.config.tune import TuneSettings
from wristctl.errors import UserError
from wristctl.tuning.optimisers import OPTIMISERS, Optimiser
from wristctl.tuning.optimisers.pso import ParticleSwarm

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))

NAMES = list(OPTIMISERS)
every = pytest.mark.parametrize("name", NAMES)
learning = pytest.mark.parametrize("name", [name for name in NAMES if name != "random"])


def sphere(unit: Array) -> Array:
    return ((unit - 0.7) ** 2).sum(axis=-1)


def rosenbrock(unit: Array) -> Array:
    x = 4.0 * unit - 2.0
    return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=-1)


def rastrigin(unit: Array) -> Array:
    x = 10.24 * (unit - 0.6)
    return (x**2 - 10.0 * np.cos(2.0 * np.pi * x) + 10.0).sum(axis=-1)


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
@pytest.mark.slow
def test_sphere_is_solved(name: str) -> None:
    assert median_best(name, sphere, 40) < 1e-5


@learning
@pytest.mark.slow
def test_optimum_in_a_corner_is_met(name: str) -> None:
    assert median_best(name, corner, 40) < 1e-6


@learning
@pytest.mark.slow
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


@pytest.mark.parametrize("objective", [rosenbrock, rastrigin])
@pytest.mark.slow
def test_swarm_is_as_good_as_an_independent_one(objective: Objective) -> None:
    """At the same budget: of its bests, none of pymoo's swarms is better more often than chance has it."""
    pytest.importorskip("pymoo")
    from pymoo.algorithms.soo.nonconvex.pso import PSO
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Landscape(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            out["F"] = objective(x)

    seeds = range(20 if THOROUGH else 7)
    problem = Landscape(n_var=3, n_obj=1, xl=0.0, xu=1.0)
    theirs = [float(minimize(problem, PSO(pop_size=20), ("n_gen", 30), seed=s).F[0]) for s in seeds]
    ours = [float(course(start("pso", seed=s), objective, 30)[1].min()) for s in seeds]
    print(f"{objective.__name__}: medians {np.median(ours):.3g} and {np.median(theirs):.3g}")
    assert mannwhitneyu(ours, theirs, alternative="greater").pvalue > 0.05


@pytest.mark.slow
def test_covariance_is_learnt_and_the_search_begins_anew_where_it_has_converged() -> None:
    """A narrow valley along the diagonal, far more narrow than an isotropic search could follow."""

    def valley(unit: Array) -> Array:
        along, across = unit[:, 0] + unit[:, 1] - 0.6, unit[:, 0] - unit[:, 1]
        return along**2 + 1e6 * across**2

    asked, values = course(start("cma-es", dim=2, candidates=10), valley, 150)
    assert (
        np.median([course(start("cma-es", dim=2, candidates=10, seed=s), valley, 50)[1].min() for s in range(5)]) < 1e-4
    )
    assert np.median([course(start("pso", dim=2, candidates=10, seed=s), valley, 50)[1].min() for s in range(5)]) > 1e-4
    spread = np.ptp(asked, axis=1).max(axis=1)
    narrow = int(np.argmax(spread < 1e-6))
    assert narrow > 0 and spread[narrow:].max() > 0.3 and values.min() < 1e-12


def test_cma_es_draws_from_its_own_generator_alone_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cma_signals.in").write_text("{'timeout': 0}")
    first = course(start("cma-es", candidates=5), rosenbrock, 30)[0]
    np.random.seed(8)  # noqa: NPY002
    before = np.random.get_state(legacy=False)  # noqa: NPY002
    assert course(start("cma-es", candidates=5), rosenbrock, 30)[0].tobytes() == first.tobytes()
    assert str(np.random.get_state(legacy=False)) == str(before)  # noqa: NPY002
    assert [each.name for each in tmp_path.iterdir()] == ["cma_signals.in"]


@pytest.mark.parametrize(("dim", "candidates"), [(1, 4), (1, 5), (9, 4)])
def test_cma_es_searches_any_number_of_gains(dim: int, candidates: int) -> None:
    values = course(start("cma-es", dim=dim, candidates=candidates), sphere, 200)[1]
    assert values.min() < 1e-3


def test_cma_es_says_how_to_install_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    with pytest.raises(UserError, match="cma") as told:
        start("cma-es")
    assert "wristctl[cma]" in str(told.value)
