"""Search for gains: every candidate of an iteration on every case, as one batch of lanes, and a choice among the best.

The same cases, budget, optimiser and starts for every law. What a search ends with is chosen on cases that it has not
seen, among its best candidates and the law's presets, so that gains are not the luck of their cases.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.config.loop import sample_period
from wristctl.config.study import Study
from wristctl.config.tune import TuneSettings
from wristctl.control.law import Controller
from wristctl.control.table import controller
from wristctl.errors import UserError, meant
from wristctl.plugins.places import contained
from wristctl.seeds import stream
from wristctl.simulation.cases import Case
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.drawn_worlds import asked_of, drawn_cases
from wristctl.simulation.planes import Asked, motion_in, planes_of
from wristctl.simulation.worlds import Draws, is_random, loops_of
from wristctl.tuning.gain_space import GainSpace
from wristctl.tuning.margin import OwnLoop
from wristctl.tuning.objective import YARDSTICK, Judge
from wristctl.tuning.optimisers import OPTIMISERS, Optimiser
from wristctl.work.worker import Unit
from wristctl.wrist.kinematics import Inverse

# Origin of gains that are not a preset's.
SEARCHED = "search"


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
    """Result of a search for gains, and its course."""

    controller: str
    gains: dict[str, float]
    objective: float
    """Objective of the gains, on the cases that they were chosen by."""
    evaluations: int
    tried: Tried
    restarts: int
    finalists: tuple[Finalist, ...] = ()
    """Best first; none as long as it goes on."""

    @property
    def best_preset(self) -> Finalist | None:
        """The best of the controller's presets, of gains that the search came upon itself; else None."""
        if not self.finalists or self.finalists[0].origin != SEARCHED:
            return None
        return next((finalist for finalist in self.finalists if finalist.origin != SEARCHED), None)

    @property
    def best_so_far(self) -> Array:
        """Least objective up to each iteration of each search, (restarts, iterations of one); nan where not begun."""
        least = self.tried.values.min(axis=1)
        iterations = -(-len(least) // self.restarts)
        padded = np.append(least, np.full(iterations * self.restarts - len(least), np.nan)).reshape(
            self.restarts, iterations
        )
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


def tuning_cases(study: Study, network: Inverse | None = None, tuning: int = 0) -> tuple[list[Case], list[Case]]:
    """Cases for the search, and cases for the choice among its best gains: other worlds, or other noise.

    The latter are none where nothing is random. Every `tuning` has other worlds of the family.
    """
    settings = study.tune
    if settings.worlds.family:
        name = settings.worlds.family
        family = study.families[name]
        draws = settings.worlds.draws, settings.worlds.validation
        return (
            drawn_cases(family, name, "tune", study.seed, draws[0], study.wrist, network, tuning * draws[0]),
            drawn_cases(family, name, "validation", study.seed, draws[1], study.wrist, network, tuning * draws[1]),
        )
    check_loops(settings)
    cases = _scenarios(study, Draws(study.seed, "tuning"), settings.repetitions, network)
    drawn = any(is_random(settings.loops[scenario.loop]) for scenario in settings.scenarios)
    return cases, _scenarios(
        study, Draws(study.seed, "validation"), settings.worlds.validation, network
    ) if drawn else []


def judges_of(study: Study, network: Inverse | None = None, tuning: int = 0) -> tuple[Judge, Judge | None]:
    """Judges of the cases to search on, and of those to choose by, None where nothing is random.

    Both judge margins on the loop that the search is for (`own_loop`).
    """
    searched, chosen = tuning_cases(study, network, tuning)
    objective, own = study.tune.objective, own_loop(study, searched, network)
    judge = Judge(searched, study.wrist, objective, own)
    return judge, Judge(chosen, study.wrist, objective, own) if chosen else None


def own_loop(study: Study, cases: Sequence[Case], network: Inverse | None = None) -> OwnLoop:
    """The loop that a search is for: of scenarios these cases, of a family its loop as stated, with its motions."""
    own = _on_its_own_loop(study, name, network) if (name := study.tune.worlds.family) else cases
    return OwnLoop(own, study.wrist, controller(YARDSTICK))


# Draws of a family's motions, each with noise of its own, on which margins are judged.
_OWN_DRAWS = 4


def _on_its_own_loop(study: Study, name: str, network: Inverse | None) -> list[Case]:
    """The motions of a family on its loop as it is stated, in the planes of its worlds."""
    family = study.families[name]
    loop = family.loop.model_copy(update={"planes": planes_of(study.wrist, asked_of(family))})
    motions = {key: source for key, source in family.draw.items() if key.startswith("reference.")}
    alone = family.model_copy(update={"loop": loop, "draw": motions, "together": ()})
    return drawn_cases(alone, name, "tune", study.seed, _OWN_DRAWS, study.wrist, network)


def asked_by(settings: TuneSettings) -> list[Asked]:
    """Loops and motions of the scenarios."""
    return [Asked(settings.loops[scenario.loop], scenario.reference) for scenario in settings.scenarios]


def _scenarios(study: Study, draws: Draws, repetitions: int, network: Inverse | None) -> list[Case]:
    """Cases of every scenario, repeated where the loop is random."""
    settings, cases = study.tune, list[Case]()
    planes = planes_of(study.wrist, asked_by(settings))
    for cell, scenario in enumerate(settings.scenarios):
        loop = settings.loops[scenario.loop]
        times = repetitions if is_random(loop) else 1
        period, name = sample_period(loop.control_period), scenario_of(scenario.reference, "ulnar")
        followed = motion_in(planes, scenario.reference, None, study.wrist, settings.horizon, period, network)
        for k, plant_loop in enumerate(loops_of(loop, [draws.plant(draw) for draw in range(times)])):
            cases.append(Case(plant_loop, followed, draws.camera(name, k), cell))
    return cases


def search(
    study: Study,
    controller: Controller,
    streams: Callable[[str], tuple[int, ...]],
    judges: tuple[Judge, Judge | None],
    progress: Callable[[Search], None] | None = None,
    known: Tried | None = None,
    choosing: AbstractContextManager[Callable[[int], object]] | None = None,
) -> Search:
    """Tune one controller with the study's optimiser, budget and objective.

    `judges` are of the cases to search on and of those to choose by, None where there are none; the choice is made in
    `choosing`, told per cent. `streams` gives the entropy of each search by its name. `progress` gets the search so far
    after every iteration; `known` is what an interrupted one had tried, which is not run again. Raises UserError where
    that is of another search.
    """
    check_tunable(controller)
    settings, space, (judge, choose) = study.tune, GainSpace.of(controller.gains), judges
    values, tried = list[Array](), list[Array]()
    for gains, tell in _searches(settings, controller, space, streams):
        iteration = len(values)
        if known is not None and iteration < len(known.values):
            if not np.array_equal(gains, known.gains[iteration]):
                problem = f"the run to resume tried other gains of {controller.name} in iteration {iteration}"
                raise UserError(problem, "tune.resume", "the settings, seed and version that it had")
            value = known.values[iteration]
        else:
            value = judge.beside(controller, gains, min((float(best.min()) for best in values), default=np.inf))
        tell(value)
        values.append(value)
        tried.append(gains)
        result = _found(controller, Tried(np.array(values), np.array(tried)), settings.restarts)
        if progress is not None:
            progress(result)
    with choosing or nullcontext(int) as report:
        return _chosen(controller, result, judge, choose, settings.finalists, report)


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
    """Context around the calls of an optimiser: empty, unless it is from elsewhere."""
    origin = OPTIMISERS.origin(optimiser)
    return contained(f"the optimiser {optimiser}", origin.reference) if origin else nullcontext()


def _presets(controller: Controller, space: GainSpace) -> dict[str, Array]:
    """The presets within the search box, by name, each (g,)."""
    preset_gains = {name: np.array(controller.values(preset)) for name, preset in controller.presets.items()}
    return {name: gains for name, gains in preset_gains.items() if ((gains >= space.low) & (gains <= space.high)).all()}


def first_tried(controller: Controller) -> str | None:
    """The preset with which a search begins: the last, for the hardest conditions; None where there is none."""
    return next(reversed(_presets(controller, GainSpace.of(controller.gains))), None)


def _start(controller: Controller, space: GainSpace) -> Array:
    """The preset with which a search begins, in the unit box; the middle where there is none."""
    preset = first_tried(controller)
    if preset is None:
        return np.full(len(space.names), 0.5)
    return np.clip(space.unit(np.array(controller.values(controller.presets[preset]))), 0.0, 1.0)


def _found(controller: Controller, tried: Tried, restarts: int) -> Search:
    best = np.unravel_index(int(np.argmin(tried.values)), tried.values.shape)
    gains = dict(zip(controller.gains, map(float, tried.gains[best]), strict=True))
    return Search(controller.name, gains, float(tried.values.min()), tried.values.size, tried, restarts)


def _chosen(
    controller: Controller, result: Search, judge: Judge, choose: Judge | None, count: int,
    report: Callable[[int], object],
) -> Search:  # fmt: skip
    """The best on the cases to choose by, of the search's best candidates and the presets."""
    flat, values = result.tried.gains.reshape(-1, len(controller.gains)), result.tried.values.ravel()
    distinct: dict[tuple[float, ...], float] = {}
    for index in np.argsort(values, kind="stable"):
        distinct.setdefault(tuple(map(float, flat[index])), float(values[index]))
    candidates = [(gains, SEARCHED, value) for gains, value in list(distinct.items())[:count]]
    if presets := _presets(controller, GainSpace.of(controller.gains)):
        judged = zip(presets.items(), judge(controller, np.array(list(presets.values()))), strict=True)
        candidates += [(tuple(map(float, each)), name, float(value)) for (name, each), value in judged]
    every = np.array([gains for gains, *_ in candidates])
    validated = (choose or judge).choice(controller, every, lambda share: report(round(100.0 * share)))
    finalists = [Finalist(*each, float(value)) for each, value in zip(candidates, validated, strict=True)]
    ordered = tuple(sorted(finalists, key=lambda finalist: finalist.validated))
    best = dict(zip(controller.gains, ordered[0].gains, strict=True))
    return replace(result, gains=best, objective=ordered[0].validated, finalists=ordered)


def search_unit(study: Study, law: str, tuning: int = 0) -> Unit:
    """The search for gains of a law by the study's `tune` section, on worlds of the family that it names.

    Every `tuning` is on other worlds of it, with another stream of the optimiser.
    """
    family, settings = study.tune.worlds.family, study.tune
    own = settings.model_copy(update={"controllers": (law,)})
    needed = study.model_copy(update={"families": {family: study.families[family]}, "tune": own})
    content = json.loads(needed.model_dump_json(by_alias=True, include={"seed", "wrist", "families", "tune"}))
    rollouts = settings.candidates * settings.iterations * settings.restarts * settings.worlds.draws
    rollouts += settings.finalists * settings.worlds.validation
    size = rollouts * len(study.families[family].references) * controller(law).learning
    spec = {"study": content, "law": law, "tuning": tuning}
    name = f"search {tuning + 1} for gains of {law} on {family}"
    return Unit("wristctl.tuning.search:searched", spec, name, size)


def search_stream(name: str, tuning: int) -> str:
    """The name of the optimiser's stream in a tuning."""
    return f"{name}, tuning {tuning + 1}" if tuning else name


def searched(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Result of one unit of `search_unit`: all gains that were tried, and the finalists, best first."""
    study, law = Study.model_validate_json(json.dumps(spec["study"])), controller(spec["law"])
    tuning = spec["tuning"]
    judges = judges_of(study, tuning=tuning)
    result = search(study, law, lambda name: stream(study.seed, search_stream(name, tuning)), judges)
    return {
        "values": result.tried.values,
        "gains": result.tried.gains,
        "finalists": np.array([finalist.gains for finalist in result.finalists]),
        "origins": np.array([finalist.origin for finalist in result.finalists]),
        "judged": np.array([(finalist.objective, finalist.validated) for finalist in result.finalists]),
    }


def search_of(arrays: Mapping[str, np.ndarray], law: str, restarts: int) -> Search:
    """The search that gave these arrays."""
    tried = Tried(arrays["values"], arrays["gains"])
    finalists = tuple(
        Finalist(tuple(map(float, gains)), str(origin), float(objective), float(validated))
        for gains, origin, (objective, validated) in zip(
            arrays["finalists"], arrays["origins"], arrays["judged"], strict=True
        )
    )
    best = dict(zip(controller(law).gains, finalists[0].gains, strict=True))
    return Search(law, best, finalists[0].validated, tried.values.size, tried, restarts, finalists)


def history(result: Search) -> pd.DataFrame:
    """Every candidate of every search: restart, iteration, candidate, objective and gains."""
    iterations, candidates = result.tried.values.shape
    per_restart = -(-iterations // result.restarts)
    iteration = np.repeat(np.arange(iterations), candidates)
    columns = {
        "restart": iteration // per_restart,
        "iteration": iteration % per_restart,
        "candidate": np.tile(np.arange(candidates), iterations),
        "objective": result.tried.values.ravel(),
    }
    gains = np.concatenate(result.tried.gains).T
    return pd.DataFrame(columns | dict(zip(result.gains, gains, strict=True)))


def tried_of(table: pd.DataFrame, gains: Sequence[str]) -> Tried:
    """Gains and values of a history's complete iterations."""
    candidates = int(table["candidate"].max()) + 1
    complete = len(table) // candidates
    rows = table.iloc[: complete * candidates]
    values = rows["objective"].to_numpy(float).reshape(complete, candidates)
    return Tried(values, rows[list(gains)].to_numpy(float).reshape(complete, candidates, len(gains)))


def finalists(result: Search) -> pd.DataFrame:
    """The gains that were judged anew, best first."""
    rows = [
        {"origin": finalist.origin, "objective": finalist.objective, "validated": finalist.validated}
        | dict(zip(result.gains, finalist.gains, strict=True))
        for finalist in result.finalists
    ]
    return pd.DataFrame(rows)
