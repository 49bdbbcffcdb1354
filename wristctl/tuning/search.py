"""Search for gains: every candidate of an iteration on every tuning scenario, as one batch of lanes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.control import Objective, TuneSettings
from wristctl.config.errors import UserError, meant
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.simulation.batch import sample_period
from wristctl.simulation.closed_loop import scenario_of, trajectory
from wristctl.simulation.draws import Draws, is_random
from wristctl.simulation.metrics import METRICS, of_trajectory
from wristctl.simulation.reference import Motion, motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.worlds import loops_of, plant_of
from wristctl.tuning.optimisers import OPTIMISERS
from wristctl.tuning.space import GainSpace
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Search:
    """What a search found, and its course over I iterations of P candidates with g gains."""

    controller: str
    gains: dict[str, float]
    objective: float
    evaluations: int
    values: Array
    """Objective of every candidate, (I, P); inf where a rollout failed."""
    tried: Array
    """Gains of every candidate, (I, P, g)."""

    @property
    def best_so_far(self) -> Array:
        """Least objective up to each iteration, (I,)."""
        return np.minimum.accumulate(self.values.min(axis=1))


def objective(metrics: Mapping[str, Array], failed: NDArray[np.bool_], weights: Objective, horizon: float) -> Array:
    """Weighted sum of metrics (count,) for each rollout, inf where it failed.

    What never happens (nan) counts what its metric says, a settling time the whole horizon; without that it has failed.
    """
    value = np.zeros(len(failed))
    for name, weight in weights.weights().items():
        never, own = METRICS[name].never, metrics[name]
        value = value + weight * (own if never is None else np.where(np.isnan(own), never(horizon), own))
    return np.where(failed | np.isnan(value), np.inf, value)


def check_loops(settings: TuneSettings) -> None:
    """UserError, naming the key, if a scenario is on a loop that the search does not have."""
    for number, scenario in enumerate(settings.scenarios):
        if scenario.loop not in settings.loops:
            where = f"scenarios.{number}.loop"
            raise UserError(f"unknown loop '{scenario.loop}'", where, meant(scenario.loop, settings.loops))


def check_tunable(controller: Controller) -> None:
    """UserError if the controller has no gains."""
    if not controller.gains:
        raise UserError(f"{controller.name} has no gains to tune", fix="leave it out")


class Evaluator:
    """Objective of candidate gains of one controller, averaged over the study's tuning scenarios and repetitions.

    All candidates of all iterations meet the same noise and plants.
    """

    def __init__(self, study: Study, controller: Controller, network: Inverse | None = None) -> None:
        check_loops(study.tune)
        self.study, self.controller = study, controller
        self.draws = Draws(study.seed, "tuning")
        self.by_loop = {}
        for name, loop in study.tune.loops.items():
            chosen = [scenario.reference for scenario in study.tune.scenarios if scenario.loop == name]
            period = sample_period(loop.control_period)
            motions = [motion(reference, study.wrist, study.tune.horizon, period, network) for reference in chosen]
            if motions:
                self.by_loop[name] = motions, [scenario_of(reference, "ulnar") for reference in chosen]

    def __call__(self, gains: Array) -> Array:
        """Objective (P,) of gains (P, g)."""
        total, count = np.zeros(len(gains)), 0
        for name, (motions, scenarios) in self.by_loop.items():
            total += self._on(self.study.tune.loops[name], motions, scenarios, gains)
            count += len(motions)
        return total / count

    def _on(self, loop: Loop, motions: list[Motion], scenarios: list[str], gains: Array) -> Array:
        """Objective of each candidate, the mean over repetitions, summed over a loop's scenarios, (P,)."""
        settings, wrist = self.study.tune, self.study.wrist
        times = settings.repetitions if is_random(loop) else 1
        loops = loops_of(loop, [self.draws.plant(each) for each in range(times)])
        count, lanes = len(motions), len(gains) * len(motions)
        which = np.repeat(np.tile(np.arange(count), len(gains)), times)
        streams = [self.draws.camera(scenario, k) for scenario in scenarios for k in range(times)] * len(gains)
        chosen: Loop | list[Loop] = loop if all(each is loop for each in loops) else loops * lanes
        recorded = [name for name in settings.objective.weights() if METRICS[name].of_trajectory is not None]
        outcome = rollout(
            self.controller, np.repeat(gains, count * times, axis=0), motions, which, chosen, wrist,
            streams=streams, record=bool(recorded),
        )  # fmt: skip
        metrics = dict(outcome.metrics)
        if recorded:
            plants = [plant_of(wrist, each.plant) for each in loops]
            courses = [
                trajectory(outcome, lane, motions[which[lane]], plants[lane % times], loop.plant.model)
                for lane in range(len(which))
            ]
            metrics |= {name: np.array([of_trajectory(each)[name] for each in courses]) for name in recorded}
        value = objective(metrics, outcome.failed, settings.objective, settings.horizon)
        total: Array = value.reshape(len(gains), count * times).sum(axis=1) / times
        return total


def search(
    study: Study,
    controller: Controller,
    rng: np.random.Generator,
    network: Inverse | None = None,
    progress: Callable[[Search], None] | None = None,
) -> Search:
    """Tune one controller with the study's optimiser, budget and objective, from the middle of its box.

    `progress` gets the search so far after every iteration, so that an interrupted one loses nothing.
    """
    check_tunable(controller)
    settings = study.tune
    space, evaluate = GainSpace.of(controller.gains), Evaluator(study, controller, network)
    start = np.full(len(controller.gains), 0.5)
    optimiser = OPTIMISERS[settings.optimiser](len(start), settings.candidates, start, rng)
    values, tried = [], []
    for _ in range(settings.iterations):
        gains = space.gains(optimiser.ask())
        value = evaluate(gains)
        optimiser.tell(value)
        values.append(value)
        tried.append(gains)
        found = _found(controller, np.array(values), np.array(tried))
        if progress is not None:
            progress(found)
    return found


def _found(controller: Controller, values: Array, tried: Array) -> Search:
    iteration, candidate = np.unravel_index(int(np.argmin(values)), values.shape)
    best = tried[iteration, candidate]
    gains = dict(zip(controller.gains, map(float, best), strict=True))
    return Search(controller.name, gains, float(values.min()), values.size, values, tried)


def history(found: Search) -> pd.DataFrame:
    """Every candidate of a search: iteration, candidate, objective and gains."""
    import pandas as pd

    iterations, candidates = found.values.shape
    columns = {
        "iteration": np.repeat(np.arange(iterations), candidates),
        "candidate": np.tile(np.arange(candidates), iterations),
        "objective": found.values.ravel(),
    }
    gains = np.concatenate(found.tried).T
    return pd.DataFrame(columns | dict(zip(found.gains, gains, strict=True)))
