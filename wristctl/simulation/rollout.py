"""Rollouts: many closed loops of one controller at once, as blocks of lanes over threads."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from threading import Event
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.lanes.blocks import to_rows
from wristctl.processes import cores, stoppable
from wristctl.seeds import Entropy
from wristctl.simulation.batch import Batch, Lanes, Start, batch
from wristctl.simulation.convergence import has_kinks, more_finely, settled
from wristctl.simulation.kernel import BRIEFLY, RECORDED, Span, run_blocks
from wristctl.simulation.metrics import Totals, summary
from wristctl.simulation.motion import Goals, Motion
from wristctl.simulation.outcome import KeptSamples, Outcome
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import World
from wristctl.wrist.plant import kernel_of

_SLICE_TICKS = 200_000
"""Control ticks of a block between two looks at whether the user has asked to stop."""
_SHARES = 8
"""Least number of pieces of work for each thread, where there are so many blocks, so that all end together."""


How = bool | Literal["briefly"]
"""Whether samples are recorded: all columns, or BRIEFLY."""


def columns_of(record: How, coordinates: int) -> int:
    """How many columns of a plant with so many coordinates are recorded."""
    if record == "briefly":
        return len(BRIEFLY)
    return len(RECORDED) + coordinates if record else 0


def rollout(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    which: NDArray[np.int64],
    loop: Loop | Sequence[Loop],
    wrist: WristParameters | Sequence[WristParameters],
    start: Start | None = None,
    streams: Sequence[Entropy] | None = None,
    record: How = False,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    stop: Event | None = None,
    converge: bool = True,
) -> Outcome:
    """Run `count` closed loops: gains (count, g) and for each the index (count,) of the motion that it follows.

    They begin at rest with the coordinates (q,) that `start` gives for the plant, straight where none is given. The
    controller's one-segment model comes from `wrist`; the loop says how finely the plant is cut, how it differs, and
    what stands between command and measurement. Loop and wrist are one for all or one for each (of one structure:
    ValueError for loops that differ in their segments, plant, timing, or levels of actuator and sensor). `streams`
    (count,) are the entropies of the cameras' noise; all meet the same where none is given. Where another thread sets
    `stop`, the outcome comes soon and is of no use. Where a loop's `substeps` are null and its integration step turns
    out to be too long, the rollout runs again with a shorter one (`wristctl.simulation.convergence`), unless `converge`
    is false. Raises what a plain law has raised; such rollouts run one by one.
    """
    count = len(gains)
    worlds, world = worlds_of(loop, wrist, count)
    lanes = Lanes(which, world, [(0,)] * count if streams is None else list(streams))
    stop = stop or Event()
    everyone = np.arange(count)

    def run(rollouts: NDArray[np.int64], times: int, progress: Callable[[float], None] | None = None) -> Outcome:
        groups = [rollouts[at : at + 1] for at in range(len(rollouts))] if controller.plain else [rollouts]
        parts = list[Outcome]()
        for number, group in enumerate(groups):

            def so_far(share: float, number: int = number) -> None:
                if progress is not None:
                    progress((number + share) / len(groups))

            there, own, followed = *part_of(worlds, lanes, group), motions
            if times > 1:
                there = [World(more_finely(world.loop, times), world.wrist) for world in there]
                numbers, motion = np.unique(own.motion, return_inverse=True)
                followed, own = [motions[number] for number in numbers], own._replace(motion=motion)
            parts.append(_run(controller, gains[group], followed, there, own, start, record, threads, so_far, stop))
        return parts[0] if len(parts) == 1 else Outcome.joined(parts, np.arange(len(rollouts)))

    outcome = run(everyone, 1, progress)
    if stop.is_set() or not converge:
        return outcome
    by_hand = np.array([there.loop.substeps is not None for there in worlds])[world]
    kinked = np.array([has_kinks(there.loop) for there in worlds])[world]
    return settled(outcome, run, by_hand, kinked, stop)


def worlds_of(
    loop: Loop | Sequence[Loop], wrist: WristParameters | Sequence[WristParameters], count: int
) -> tuple[list[World], NDArray[np.int64]]:
    """The worlds that there are, and which of them each rollout has, (count,)."""
    if isinstance(loop, Loop) and isinstance(wrist, WristParameters):
        return [World(loop, wrist)], np.zeros(count, np.int64)
    loops = [loop] * count if isinstance(loop, Loop) else loop
    wrists = [wrist] * count if isinstance(wrist, WristParameters) else wrist
    numbers: dict[tuple[int, int], int] = {}
    worlds: list[World] = []
    which = np.empty(count, np.int64)
    for lane, pair in enumerate(zip(loops, wrists, strict=True)):
        number = numbers.setdefault((id(pair[0]), id(pair[1])), len(worlds))
        if number == len(worlds):
            worlds.append(World(*pair))
        which[lane] = number
    if len({structure(each.loop) for each in worlds}) != 1:
        raise ValueError("loops of one batch differ in segments, plant, timing, or levels of actuator and sensor")
    return worlds, which


def structure(loop: Loop) -> tuple[object, ...]:
    """What loops of one batch have in common."""
    timing = loop.control_period, loop.steps
    return loop.plant.model, loop.plant_segments, *timing, loop.actuator.level, loop.sensor.level


def part_of(worlds: Sequence[World], lanes: Lanes, own: NDArray[np.intp]) -> tuple[list[World], Lanes]:
    """Worlds and lanes of some of the rollouts."""
    there, which = np.unique(lanes.world[own], return_inverse=True)
    return [worlds[each] for each in there], Lanes(lanes.motion[own], which, [lanes.streams[each] for each in own])


def _run(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    worlds: Sequence[World],
    lanes: Lanes,
    start: Start | None,
    record: How,
    threads: int | None,
    progress: Callable[[float], None],
    stop: Event,
) -> Outcome:
    loop, count = worlds[0].loop, len(gains)
    model = PLANTS[loop.plant.model]
    columns = columns_of(record, model.coordinates(loop.plant_segments))
    done = batch(controller, gains, motions, worlds, lanes, model, start, columns)
    _advance(done, kernel_of(run_blocks, model), threads or cores(), progress, stop)
    done.setup.law.check()
    return outcome_of(done, count, loop, KeptSamples.of(done.state.record, count) if record else None)


def outcome_of(done: Batch, count: int, loop: Loop, kept: KeptSamples | None = None) -> Outcome:
    """What has become of a batch's rollouts, so far as they have come."""
    sums, goals = to_rows(done.state.sums, count), to_rows(done.world.goals, count)
    named = dict(zip(SUMS, sums.T, strict=True)), dict(zip(Goals._fields, goals.T, strict=True))
    totals = Totals(*named, loop.control_period)
    failed, until = totals.sums["alive"] <= 0.0, totals.sums["until"]
    steps, error, drift = np.full(count, loop.steps), totals.sums["step_error"], np.zeros(count)
    return Outcome(summary(totals), failed, until, done.course.references, steps, error, drift, kept)


def _advance(
    done: Batch, kernel: Callable[..., None], workers: int, progress: Callable[[float], None], stop: Event
) -> None:
    """Run all blocks to the end, or until they are to stop, on so many threads."""
    setup, blocks, samples = done.setup, done.blocks, done.samples
    each = samples * setup.ticks * setup.substeps
    together = max(1, min(_SLICE_TICKS // each, blocks // (_SHARES * workers)))
    piece = max(1, _SLICE_TICKS // (setup.ticks * setup.substeps))
    ended = [0] * blocks

    def run(begin: int) -> None:
        end, scratch = min(begin + together, blocks), done.scratch()
        for first in range(0, samples, piece):
            if stop.is_set():
                return
            last = min(first + piece, samples)
            kernel(setup, done.course, done.world, done.state, scratch, Span(begin, end, first, last))
            ended[begin:end] = [last] * (end - begin)

    pieces = range(0, blocks, together)
    if min(workers, len(pieces)) == 1:
        for begin in pieces:
            run(begin)
            progress(sum(ended) / (blocks * samples))
        return
    with stoppable(workers, stop) as pool:
        for _ in pool.map(run, pieces):
            progress(sum(ended) / (blocks * samples))


def stream(
    controller: Controller,
    batches: Iterable[NDArray[np.float64]],
    followed: Motion,
    loop: Loop,
    wrist: WristParameters,
    threads: int | None = None,
) -> Iterator[Outcome]:
    """Outcomes of batches of gains, each (count, g), as they come, all on one motion; nothing of them is kept.

    The caller reduces each outcome (a histogram, a best, a line in a file), so that a million rollouts need no more
    memory than one batch. A few thousand lanes a batch keep all threads busy.
    """
    for gains in batches:
        yield rollout(controller, gains, [followed], np.zeros(len(gains), np.int64), loop, wrist, threads=threads)
