"""Search for gains: every candidate of an iteration on every tuning scenario, as one batch of lanes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wristctl.config.control import Objective, TuneSettings
from wristctl.config.errors import UserError, meant
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import Outcome, rollout, sample_period
from wristctl.tuning.optimisers import OPTIMISERS
from wristctl.tuning.space import GainSpace
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


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


def objective(outcome: Outcome, weights: Objective, horizon: float) -> Array:
    """Weighted sum of metrics for each rollout, inf where it failed; what never settles counts the whole horizon."""
    of = outcome.metrics
    settling = np.where(np.isnan(of["settling"]), horizon, of["settling"])
    value = (
        weights.rmse * of["rmse"]
        + weights.settling * settling
        + weights.chattering * of["chattering"]
        + weights.saturation * of["saturation"]
    )
    return np.where(outcome.failed | np.isnan(value), np.inf, value)


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
    """Objective of candidate gains of one controller, averaged over the study's tuning scenarios."""

    def __init__(self, study: Study, controller: Controller, network: Inverse | None = None) -> None:
        check_loops(study.tune)
        self.study, self.controller = study, controller
        self.by_loop = {}
        for name, loop in study.tune.loops.items():
            chosen = [scenario.reference for scenario in study.tune.scenarios if scenario.loop == name]
            period = sample_period(loop)
            motions = [motion(reference, study.wrist, study.tune.horizon, period, network) for reference in chosen]
            if motions:
                self.by_loop[name] = motions

    def __call__(self, gains: Array) -> Array:
        """Objective (P,) of gains (P, g)."""
        settings, total, count = self.study.tune, np.zeros(len(gains)), 0
        for name, motions in self.by_loop.items():
            batch = np.repeat(gains, len(motions), axis=0)
            which = np.tile(np.arange(len(motions)), len(gains))
            outcome = rollout(self.controller, batch, motions, which, settings.loops[name], self.study.wrist)
            total += objective(outcome, settings.objective, settings.horizon).reshape(len(gains), -1).sum(axis=1)
            count += len(motions)
        return total / count


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
        "objective": found.values.reshape(-1),
    }
    each = found.tried.reshape(iterations * candidates, -1)
    return pd.DataFrame(columns | dict(zip(found.gains, each.T, strict=True)))
