"""Search for gains: every candidate of an iteration on every case, as one batch of lanes, and a choice among the best.

The same cases, budget, optimiser and starts for every law. What a search ends with is chosen on cases that it has not
seen, among its best candidates and the law's presets, so that gains are not the luck of their cases.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.control import TuneSettings
from wristctl.config.errors import UserError, meant
from wristctl.config.foreign import contained
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.simulation.batch import sample_period
from wristctl.simulation.cases import Case
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.draws import Draws, is_random
from wristctl.simulation.reference import motion
from wristctl.simulation.worlds import loops_of
from wristctl.tuning.objective import Judge
from wristctl.tuning.optimisers import OPTIMISERS, Optimiser
from wristctl.tuning.space import GainSpace
from wristctl.wrist.kinematics import Inverse


class Tried(NamedTuple):
    """Every candidate so far, of I iterations with P candidates of g gains, one search after the other."""

    values: Array
    """Objective of every candidate, (I, P)."""
    gains: Array
    """(I, P, g)"""


class Finalist(NamedTuple):
    """Gains that were judged anew."""

    gains: tuple[float, ...]
    origin: str
    """`search`, or the preset's name."""
    objective: float
    """On the cases of the search."""
    validated: float
    """On those that it had not seen."""


@dataclass(frozen=True)
class Search:
    """What a search found, and its course."""

    controller: str
    gains: dict[str, float]
    objective: float
    """Of the gains, on the cases that they were chosen by."""
    evaluations: int
    tried: Tried
    restarts: int
    finalists: tuple[Finalist, ...] = ()
    """Best first; none as long as it goes on."""

    @property
    def best_so_far(self) -> Array:
        """Least objective up to each iteration of each search, (restarts, iterations of one); nan where not begun."""
        least = self.tried.values.min(axis=1)
        each = -(-len(least) // self.restarts)
        padded = np.append(least, np.full(each * self.restarts - len(least), np.nan)).reshape(self.restarts, each)
        return np.minimum.accumulate(padded, axis=1)


def check_loops(settings: TuneSettings) -> None:
    """UserError, naming the key, if a scenario is on a loop that the search does not have."""
    for number, scenario in enumerate(settings.scenarios):
        if scenario.loop not in settings.loops:
            where = f"scenarios.{number}.loop"
            raise UserError(f"unknown loop '{scenario.loop}'", where, meant(scenario.loop, settings.loops))


def check_optimiser(settings: TuneSettings) -> None:
    """UserError where the optimiser needs more candidates, or a package that is not installed."""
    with _contained(settings.optimiser):
        OPTIMISERS[settings.optimiser](2, settings.candidates, np.full(2, 0.5), np.random.default_rng(0))


def check_tunable(controller: Controller) -> None:
    """UserError if the controller has no gains."""
    if not controller.gains:
        raise UserError(f"{controller.name} has no gains to tune", fix="leave it out")


def tuning_cases(study: Study, network: Inverse | None = None) -> tuple[list[Case], list[Case]]:
    """What gains are searched on, and what the best of them are chosen by: other worlds, or other noise.

    The latter are none where nothing is random.
    """
    settings = study.tune
    if settings.worlds.family:
        name = settings.worlds.family
        family = study.families[name]
        draws = settings.worlds.draws, settings.worlds.validation
        return (
            drawn_cases(family, name, "tune", study.seed, draws[0], study.wrist, network),
            drawn_cases(family, name, "validation", study.seed, draws[1], study.wrist, network),
        )
    check_loops(settings)
    cases = _scenarios(study, Draws(study.seed, "tuning"), settings.repetitions, network)
    drawn = any(is_random(settings.loops[each.loop]) for each in settings.scenarios)
    return cases, _scenarios(
        study, Draws(study.seed, "validation"), settings.worlds.validation, network
    ) if drawn else []


def _scenarios(study: Study, draws: Draws, repetitions: int, network: Inverse | None) -> list[Case]:
    """Each scenario as often as asked for, where that makes a difference."""
    settings, cases = study.tune, list[Case]()
    for cell, scenario in enumerate(settings.scenarios):
        loop = settings.loops[scenario.loop]
        times = repetitions if is_random(loop) else 1
        period, name = sample_period(loop.control_period), scenario_of(scenario.reference, "ulnar")
        followed = motion(scenario.reference, study.wrist, settings.horizon, period, network)
        for k, own in enumerate(loops_of(loop, [draws.plant(each) for each in range(times)])):
            cases.append(Case(own, followed, draws.camera(name, k), cell))
    return cases


def search(
    study: Study,
    controller: Controller,
    streams: Callable[[str], tuple[int, ...]],
    judges: tuple[Judge, Judge | None],
    progress: Callable[[Search], None] | None = None,
    known: Tried | None = None,
) -> Search:
    """Tune one controller with the study's optimiser, budget and objective.

    `judges` are of the cases to search on and of those to choose by, None where there are none. `streams` gives the
    entropy of each of the searches by its name. `progress` gets the search so far after every iteration, so that an
    interrupted one loses nothing; `known` is what such a one had tried, which is not run again. Raises UserError where
    that is of another search.
    """
    check_tunable(controller)
    settings, space, (judge, choose) = study.tune, GainSpace.of(controller.gains), judges
    values, tried = list[Array](), list[Array]()
    for gains, tell in _searches(settings, controller, space, streams):
        at = len(values)
        if known is not None and at < len(known.values):
            if not np.array_equal(gains, known.gains[at]):
                what = f"the run to resume tried other gains of {controller.name} in iteration {at}"
                raise UserError(what, "tune.resume", "the settings, seed and version that it had")
            value = known.values[at]
        else:
            value = judge.beside(controller, gains, min((float(each.min()) for each in values), default=np.inf))
        tell(value)
        values.append(value)
        tried.append(gains)
        found = _found(controller, Tried(np.array(values), np.array(tried)), settings.restarts)
        if progress is not None:
            progress(found)
    return _chosen(controller, found, judge, choose, settings.finalists)


def _searches(
    settings: TuneSettings, controller: Controller, space: GainSpace, streams: Callable[[str], tuple[int, ...]]
) -> Iterator[tuple[Array, Callable[[Array], None]]]:
    """The candidates (P, g) of each iteration of each search, and what to tell of their values."""
    for restart in range(settings.restarts):
        start = _start(controller, space) if restart == 0 else np.full(len(controller.gains), 0.5)
        name = f"search {controller.name}" + (f" {restart}" if restart else "")
        rng = np.random.default_rng(streams(name))
        with _contained(settings.optimiser):
            optimiser = OPTIMISERS[settings.optimiser](len(start), settings.candidates, start, rng)

        def tell(values: Array, optimiser: Optimiser = optimiser) -> None:
            with _contained(settings.optimiser):
                optimiser.tell(values)

        for _ in range(settings.iterations):
            with _contained(settings.optimiser):
                asked = optimiser.ask()
            yield space.gains(asked), tell


def _contained(optimiser: str) -> AbstractContextManager[None]:
    """What surrounds the calls of an optimiser: nothing, unless it is from elsewhere."""
    origin = OPTIMISERS.origin(optimiser)
    return contained(f"the optimiser {optimiser}", origin.reference) if origin else nullcontext()


def _presets(controller: Controller, space: GainSpace) -> dict[str, Array]:
    """The presets within the search box, by name, each (g,)."""
    given = {name: np.array(controller.values(each)) for name, each in controller.presets.items()}
    return {name: each for name, each in given.items() if ((each >= space.low) & (each <= space.high)).all()}


def _start(controller: Controller, space: GainSpace) -> Array:
    """A preset in the unit box: the last, which is for the hardest conditions; the middle where there is none."""
    presets = list(_presets(controller, space).values())
    return np.clip(space.unit(presets[-1]), 0.0, 1.0) if presets else np.full(len(space.names), 0.5)


def _found(controller: Controller, tried: Tried, restarts: int) -> Search:
    at = np.unravel_index(int(np.argmin(tried.values)), tried.values.shape)
    gains = dict(zip(controller.gains, map(float, tried.gains[at]), strict=True))
    return Search(controller.name, gains, float(tried.values.min()), tried.values.size, tried, restarts)


def _chosen(controller: Controller, found: Search, judge: Judge, choose: Judge | None, count: int) -> Search:
    """The best on the cases to choose by, of the search's best candidates and the presets."""
    flat, values = found.tried.gains.reshape(-1, len(controller.gains)), found.tried.values.ravel()
    distinct: dict[tuple[float, ...], float] = {}
    for at in np.argsort(values, kind="stable"):
        distinct.setdefault(tuple(map(float, flat[at])), float(values[at]))
    known = [(gains, "search", value) for gains, value in list(distinct.items())[:count]]
    if presets := _presets(controller, GainSpace.of(controller.gains)):
        judged = judge(controller, np.array(list(presets.values())))
        for (name, each), value in zip(presets.items(), judged, strict=True):
            known.append((tuple(map(float, each)), name, float(value)))
    if choose is None:
        validated = judge(controller, np.array([gains for gains, *_ in known]))
    else:
        validated = choose(controller, np.array([gains for gains, *_ in known]))
    every = [Finalist(*each, float(value)) for each, value in zip(known, validated, strict=True)]
    ordered = tuple(sorted(every, key=lambda each: each.validated))
    best = dict(zip(controller.gains, ordered[0].gains, strict=True))
    return Search(
        controller.name, best, ordered[0].validated, found.evaluations, found.tried, found.restarts, ordered
    )  # fmt: skip
