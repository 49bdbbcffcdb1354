"""Closed loops that differ in any of their numbers, run beside each other as lanes."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.seeds import Entropy
from wristctl.simulation.arrival import SHORT
from wristctl.simulation.batch import Start
from wristctl.simulation.cases import AT_ONCE, at_most, at_once
from wristctl.simulation.closed_loop import asked_of, equilibrium, scenario_of
from wristctl.simulation.metrics import metrics_in
from wristctl.simulation.motion import Motion
from wristctl.simulation.oscillation import LIMIT_CYCLE, REST, chatter
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.repetitions import MARKS, STRAIN
from wristctl.simulation.rollout import rollout, structure
from wristctl.simulation.trajectory import size_of
from wristctl.simulation.worlds import Draws, is_random, loops_of
from wristctl.wrist.tendon_layout import TendonLayout


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
        """Properties that loops in the lanes of one batch have in common."""
        layout = None if self.motion.planes == 1 else TendonLayout.of(self.wrist)
        return self.law.name, *structure(self.loop), len(self.motion.time), self.at_rest, layout


class SweptMetrics(NamedTuple):
    """Metrics of rollouts, (count,) each."""

    metrics: dict[str, Array]
    """Those of each plane are nan of loops in one."""
    failed: NDArray[np.bool_]
    until: Array
    """When each was last within its range [s]."""
    places: NDArray[np.int64]
    """Places of tendons of each loop: in one plane its two sides."""


def swept_loops(study: Study) -> list[SweptLoop]:
    """The rollouts of the study's `simulate` section, one for each of its repetitions; gains are a preset's or values.

    Each is the very rollout of `simulate`, with its noise and its plant.
    """
    chosen, draws = study.simulate, Draws(study.seed)
    law = controller(chosen.controller)
    wrist, loop, followed = asked_of(study, sample_period(chosen.loop.control_period), later=True)
    times = chosen.repetitions if is_random(loop) else 1
    scenario = scenario_of(chosen.reference, chosen.direction)
    loops = loops_of(loop, [draws.plant(repetition) for repetition in range(times)])
    at_rest, gains = chosen.start == "equilibrium", gains_of(law, chosen.gains, loop=chosen.loop)
    return [
        SweptLoop(law, gains, drawn, wrist, followed, draws.camera(scenario, k), at_rest)
        for k, drawn in enumerate(loops)
    ]


def swept_metrics(planes: int = 1) -> list[str]:
    """The metrics that are taken of many loops in so many planes at once."""
    return [name for name, metric in metrics_in(planes).items() if metric.of_totals is not None or name in AT_ONCE]


def run_swept(loops: Iterable[SweptLoop]) -> SweptMetrics:
    """Run all loops, those that differ in numbers alone side by side."""
    order, judged = list[int](), list[Future[SweptMetrics]]()
    with ThreadPoolExecutor(1) as beside:  # judges while the next ones are laid out, which takes one processor
        for numbers, piece in _pieces(loops):
            order += numbers
            results = _run(piece)
            wait(judged[-1:])  # of what is kept of samples there is never more than two batches'
            judged.append(beside.submit(_judged, swept_metrics(piece[0].motion.planes), *results))
    parts = [future.result() for future in judged]
    back = np.argsort(order, kind="stable")
    names = max((list(part.metrics) for part in parts), key=len)
    unknown = [np.full(len(part.failed), np.nan) for part in parts]
    metrics = {
        name: np.concatenate([part.metrics.get(name, nan) for part, nan in zip(parts, unknown, strict=True)])[back]
        for name in names
    }
    failed, until, places = (
        np.concatenate(columns)[back] for columns in zip(*(columns[1:] for columns in parts), strict=True)
    )
    return SweptMetrics(metrics, failed, until, places)


def _pieces(loops: Iterable[SweptLoop]) -> Iterator[tuple[list[int], list[SweptLoop]]]:
    """Loops that can run as lanes of one batch, with their numbers, as soon as there are enough of a kind."""
    waiting: dict[tuple[object, ...], tuple[list[int], list[SweptLoop]]] = {}
    most = dict[tuple[object, ...], int]()
    for number, loop in enumerate(loops):
        kind = loop.kind
        if kind not in most:
            most[kind] = at_most(loop.loop, loop.motion, "briefly")
        numbers, piece = waiting.setdefault(kind, ([], []))
        numbers.append(number)
        piece.append(loop)
        if len(piece) == most[kind]:
            yield waiting.pop(kind)
    yield from waiting.values()


def _run(chosen: Sequence[SweptLoop]) -> tuple[Outcome, NDArray[np.int64], float]:
    """Outcome of loops, which reference each followed, and the time between samples [s]."""
    first = chosen[0]
    motions = list({id(loop.motion.angles): loop.motion for loop in chosen}.values())  # which may differ in tips
    numbers = {id(followed.angles): number for number, followed in enumerate(motions)}
    which = np.array([numbers[id(loop.motion.angles)] for loop in chosen])
    start: Start | None = equilibrium(first.loop, first.motion.planes) if first.at_rest else None
    outcome = rollout(
        first.law, np.array([loop.gains for loop in chosen]).reshape(len(chosen), -1), motions, which,
        [loop.loop for loop in chosen], [loop.wrist for loop in chosen], start, [loop.stream for loop in chosen],
        record="briefly",
    )  # fmt: skip
    return outcome, which, float(first.motion.time[1])


def fates(loops: Sequence[SweptLoop], swept: SweptMetrics) -> list[str]:
    """The marks of each loop, with commas; empty where it is sound. Where its reference never rests it may be short."""
    metrics, wrists = swept.metrics, [loop.wrist for loop in loops]
    goals = [loop.motion.goals for loop in loops]
    rests = np.array([goal.rest <= 0.9 * goal.horizon for goal in goals])
    long = np.array([goal.rest <= goal.horizon - REST for goal in goals])
    moves = np.array([size_of(loop.motion.bend_ref).max() for loop in loops])
    limits = np.array([wrist.tension_limit for wrist in wrists])
    holds = (
        swept.failed,
        rests & (metrics["steady_state"] > SHORT * moves),
        long & (metrics["oscillation"] > LIMIT_CYCLE),
        chatter(metrics["chattering"], [wrist.tension_range for wrist in wrists], swept.places) > 0.0,
        metrics["peak_tension"] > STRAIN * limits,
        metrics["drift"] > 0.0,
    )
    return [
        MARKS[0] if failed else ", ".join(mark for mark, one in zip(MARKS[1:], marks, strict=True) if one)
        for failed, *marks in zip(*holds, strict=True)
    ]


def _judged(names: Sequence[str], outcome: Outcome, which: NDArray[np.int64], step: float) -> SweptMetrics:
    values = outcome.metrics | at_once(names, outcome, which, step)
    places = np.full(len(outcome.failed), outcome.places)
    return SweptMetrics({name: values[name] for name in names}, outcome.failed, outcome.until, places)
