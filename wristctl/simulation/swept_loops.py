"""Closed loops that differ in any of their numbers, run beside each other as lanes."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.seeds import Entropy
from wristctl.simulation.arrival import SHORT
from wristctl.simulation.batch import Start, sample_period
from wristctl.simulation.cases import AT_ONCE, at_most, at_once
from wristctl.simulation.closed_loop import equilibrium, scenario_of
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.motion import Motion
from wristctl.simulation.oscillation import LIMIT_CYCLE, REST, chatter
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion, toward
from wristctl.simulation.repetitions import MARKS, STRAIN
from wristctl.simulation.rollout import rollout, structure
from wristctl.simulation.worlds import Draws, is_random, loop_facing, loops_of


class SweptLoop(NamedTuple):
    """A rollout of a study's `simulate` section."""

    law: Controller
    gains: tuple[float, ...]
    loop: Loop
    wrist: WristParameters
    """As it is known."""
    motion: Motion
    stream: Entropy
    at_rest: bool
    """Begins in equilibrium, and not straight."""

    @property
    def kind(self) -> tuple[object, ...]:
        """What loops that run as lanes of one batch have in common."""
        return self.law.name, *structure(self.loop), len(self.motion.time), self.at_rest


class SweptMetrics(NamedTuple):
    """Of rollouts, (count,) each."""

    metrics: dict[str, Array]
    failed: NDArray[np.bool_]
    until: Array
    """When each was last within its range [s]."""


def swept_loops(study: Study) -> list[SweptLoop]:
    """The rollouts of the study's `simulate` section, one for each of its repetitions; gains are a preset's or values.

    Each is the very rollout of `simulate`, with its noise and its plant.
    """
    chosen, draws = study.simulate, Draws(study.seed)
    wrist, loop = loop_facing(study.wrist, chosen.loop, chosen.direction)
    law = controller(chosen.controller)
    asked, period = toward(chosen.reference, chosen.direction), sample_period(loop.control_period)
    followed = motion(asked, wrist, chosen.horizon, period, later=True)
    times = chosen.repetitions if is_random(loop) else 1
    scenario = scenario_of(chosen.reference, chosen.direction)
    loops = loops_of(loop, [draws.plant(each) for each in range(times)])
    at_rest, gains = chosen.start == "equilibrium", gains_of(law, chosen.gains)
    return [
        SweptLoop(law, gains, own, wrist, followed, draws.camera(scenario, k), at_rest) for k, own in enumerate(loops)
    ]


def swept_metrics() -> list[str]:
    """The metrics that are taken of many loops at once."""
    return [name for name, metric in METRICS.items() if metric.of_totals is not None or name in AT_ONCE]


def run_swept(loops: Iterable[SweptLoop]) -> SweptMetrics:
    """Run all loops, those that differ in numbers alone side by side."""
    names, order, judged = swept_metrics(), list[int](), list[Future[SweptMetrics]]()
    with ThreadPoolExecutor(1) as beside:  # judges while the next ones are laid out, which takes one processor
        for numbers, own in _pieces(loops):
            order += numbers
            done = _run(own)
            wait(judged[-1:])  # of what is kept of samples there is never more than two batches'
            judged.append(beside.submit(_judged, names, *done))
    found = [each.result() for each in judged]
    back = np.argsort(order, kind="stable")
    metrics = {name: np.concatenate([each.metrics[name] for each in found])[back] for name in names}
    failed, until = (np.concatenate(each)[back] for each in zip(*(each[1:] for each in found), strict=True))
    return SweptMetrics(metrics, failed, until)


def _pieces(loops: Iterable[SweptLoop]) -> Iterator[tuple[list[int], list[SweptLoop]]]:
    """Loops that can run as lanes of one batch, with their numbers, as soon as there are enough of a kind."""
    waiting: dict[tuple[object, ...], tuple[list[int], list[SweptLoop]]] = {}
    most = dict[tuple[object, ...], int]()
    for number, each in enumerate(loops):
        kind = each.kind
        if kind not in most:
            most[kind] = at_most(each.loop, each.motion, "briefly")
        numbers, own = waiting.setdefault(kind, ([], []))
        numbers.append(number)
        own.append(each)
        if len(own) == most[kind]:
            yield waiting.pop(kind)
    yield from waiting.values()


def _run(chosen: Sequence[SweptLoop]) -> tuple[Outcome, NDArray[np.int64], float]:
    """What became of them, which reference each followed, and the time between samples [s]."""
    first = chosen[0]
    motions = list({id(each.motion.angles): each.motion for each in chosen}.values())  # which may differ in tips
    numbers = {id(each.angles): number for number, each in enumerate(motions)}
    which = np.array([numbers[id(each.motion.angles)] for each in chosen])
    start: Start | None = equilibrium(first.loop) if first.at_rest else None
    outcome = rollout(
        first.law, np.array([each.gains for each in chosen]).reshape(len(chosen), -1), motions, which,
        [each.loop for each in chosen], [each.wrist for each in chosen], start, [each.stream for each in chosen],
        record="briefly",
    )  # fmt: skip
    return outcome, which, float(first.motion.time[1])


def fates(loops: Sequence[SweptLoop], found: SweptMetrics) -> list[str]:
    """The marks of each loop, with commas; empty where it is sound. Where its reference never rests it may be short."""
    metrics, wrists = found.metrics, [each.wrist for each in loops]
    goals = [each.motion.goals for each in loops]
    rests = np.array([each.rest <= 0.9 * each.horizon for each in goals])
    long = np.array([each.rest <= each.horizon - REST for each in goals])
    moves = np.array([np.abs(each.motion.theta_ref).max() for each in loops])
    limits = np.array([each.tension_limit for each in wrists])
    holds = (
        found.failed,
        rests & (metrics["steady_state"] > SHORT * moves),
        long & (metrics["oscillation"] > LIMIT_CYCLE),
        chatter(metrics["chattering"], [each.tension_range for each in wrists]) > 0.0,
        metrics["peak_tension"] > STRAIN * limits,
        metrics["drift"] > 0.0,
    )
    return [
        MARKS[0] if failed else ", ".join(mark for mark, one in zip(MARKS[1:], others, strict=True) if one)
        for failed, *others in zip(*holds, strict=True)
    ]


def _judged(names: Sequence[str], outcome: Outcome, which: NDArray[np.int64], step: float) -> SweptMetrics:
    known = outcome.metrics | at_once(names, outcome, which, step)
    return SweptMetrics({name: known[name] for name in names}, outcome.failed, outcome.until)
