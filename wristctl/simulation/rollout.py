"""Rollouts: many closed loops of one controller at once, as blocks of lanes over threads."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from threading import Event
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.lanes.blocks import to_rows
from wristctl.processes import cores, stoppable
from wristctl.seeds import Entropy
from wristctl.simulation.batch import Batch, Lanes, Start, batch
from wristctl.simulation.convergence import has_kinks, more_finely, settled
from wristctl.simulation.kernel import Span, columns_of_brief, columns_of_sample, run_blocks
from wristctl.simulation.metrics import Totals, metrics_in, summary
from wristctl.simulation.motion import GOALS, Motion
from wristctl.simulation.outcome import KeptSamples, Outcome
from wristctl.simulation.simulated_drives import SIDES
from wristctl.simulation.sums import SUMS, sums_by_name
from wristctl.simulation.worlds import World
from wristctl.wrist.plant import PlantModel, kernel_of, plant_in
from wristctl.wrist.tendon_layout import TendonLayout

# Control ticks of a block between two looks at whether the user has asked to stop.
_SLICE_TICKS = 200_000
# Share of the time of rollouts before those in doubt run again, and of what is then left that each further pass takes.
FIRST_PASS, AGAIN = 0.3, 0.5
# Least number of pieces of work for each thread, where there are so many blocks, so that all end together.
_SHARES = 8
_ALIVE = SUMS.index("alive")


# Whether samples are recorded: all columns, or BRIEFLY.
How = bool | Literal["briefly"]


def columns_of(record: How, coordinates: int, planes: int = 1, places: int = 2) -> int:
    """Number of recorded columns of a plant with so many coordinates."""
    if record == "briefly":
        return columns_of_brief(planes)
    return len(columns_of_sample(planes, places)) + coordinates if record else 0


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
    force: Array | None = None,
) -> Outcome:
    """Run `count` closed loops: gains (count, g) and for each the index (count,) of the motion that it follows.

    They bend in the planes of the motions, and begin at rest with the coordinates (q,) that `start` gives for the
    plant, straight where none is given. The controller's one-segment model comes from `wrist`; the loop says how finely
    the plant is cut, how it differs, and what stands between command and measurement. Loop and wrist are one for all or
    one for each (of one structure: ValueError for loops that differ in their segments, plant, timing, or levels of
    actuator and sensor, and for wrists with other numbers of tendons). `streams` (count,) are the entropies of the
    cameras' noise; all meet the same where none is given. Where another thread sets `stop`, the outcome comes soon and
    is of no use. Where a loop's `substeps` are null and its integration step turns out to be too long, the rollout runs
    again with a shorter one (`wristctl.simulation.convergence`), unless `converge` is false. A `force` on the tip, (3,)
    or (3, T) [N], along the base, toward ulnar and toward flexion, acts beside the loops' own disturbances. Raises what
    a plain law has raised; such rollouts run one by one. UserError for facts that no loop in two planes has.
    """
    count = len(gains)
    worlds, world = worlds_of(loop, wrist, count)
    model = plant_in(motions[0].planes, worlds[0].loop.plant.model)
    if model.planes == 2:
        check_two_planes(worlds)
    if force is not None:
        force = np.broadcast_to(np.reshape(force, (3, -1)), (3, len(motions[0].time)))
    lanes = Lanes(which, world, [(0,)] * count if streams is None else list(streams))
    stop = stop or Event()
    everyone = np.arange(count)

    def run(rollouts: NDArray[np.int64], times: int, progress: Callable[[float], object]) -> Outcome:
        groups = [rollouts[lane : lane + 1] for lane in range(len(rollouts))] if controller.plain else [rollouts]
        parts = list[Outcome]()
        for number, group in enumerate(groups):

            def so_far(share: float, number: int = number) -> None:
                progress((number + share) / len(groups))

            group_worlds, group_lanes, followed = *part_of(worlds, lanes, group), motions
            if times > 1:
                group_worlds = [World(more_finely(world.loop, times), world.wrist) for world in group_worlds]
                numbers, motion = np.unique(group_lanes.motion, return_inverse=True)
                followed, group_lanes = [motions[number] for number in numbers], group_lanes._replace(motion=motion)
            parts.append(
                _run(
                    controller, gains[group], followed, group_worlds, group_lanes, model, start, record, threads,
                    so_far, stop, force,
                )
            )  # fmt: skip
        return parts[0] if len(parts) == 1 else Outcome.joined(parts, np.arange(len(rollouts)))

    told, report = 0.0, progress or (lambda share: None)

    def pass_of(rollouts: NDArray[np.int64], times: int, share: float = AGAIN) -> Outcome:
        """Rollouts that take this share of what is left to be told."""
        nonlocal told
        begin, told = told, told + share * (1.0 - told)
        return run(rollouts, times, lambda done: report(begin + (told - begin) * done))

    outcome = pass_of(everyone, 1, FIRST_PASS if converge else 1.0)
    if stop.is_set() or not converge:
        return outcome
    by_hand = np.array([setting.loop.substeps is not None for setting in worlds])[world]
    kinked = np.array([has_kinks(setting.loop) for setting in worlds])[world]
    bears = np.array([setting.wrist.tension_range for setting in worlds])[world]
    outcome = settled(outcome, pass_of, by_hand, kinked, bears, stop)
    report(1.0)
    return outcome


def check_two_planes(worlds: Sequence[World]) -> None:
    """UserError for facts that no loop in two planes has, or wrists that no plant there can be.

    ValueError for wrists with other numbers of tendons.
    """
    for world in worlds:
        plant_in(2, world.loop.plant.model).values(world.plant, world.loop.plant_segments)
    if len({len(TendonLayout.of(world.wrist).places) for world in worlds}) != 1:
        raise ValueError("wrists of one batch have other numbers of tendons")


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
    if len({structure(world.loop) for world in worlds}) != 1:
        raise ValueError("loops of one batch differ in segments, plant, timing, or levels of actuator and sensor")
    return worlds, which


def structure(loop: Loop) -> tuple[object, ...]:
    """Structure that loops of one batch have in common."""
    timing = loop.control_period, loop.steps
    return loop.plant.model, loop.plant_segments, *timing, loop.actuator.level, loop.sensor.level


def part_of(worlds: Sequence[World], lanes: Lanes, rollouts: NDArray[np.intp]) -> tuple[list[World], Lanes]:
    """Worlds and lanes of some of the rollouts."""
    numbers, which = np.unique(lanes.world[rollouts], return_inverse=True)
    return [worlds[index] for index in numbers], Lanes(
        lanes.motion[rollouts], which, [lanes.streams[index] for index in rollouts]
    )


def _run(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    worlds: Sequence[World],
    lanes: Lanes,
    model: PlantModel,
    start: Start | None,
    record: How,
    threads: int | None,
    progress: Callable[[float], None],
    stop: Event,
    force: Array | None,
) -> Outcome:
    loop, count = worlds[0].loop, len(gains)
    places = len(SIDES) if model.planes == 1 else len(TendonLayout.of(worlds[0].wrist).places)
    columns = columns_of(record, model.coordinates(loop.plant_segments), model.planes, places)
    kernel, learning = kernel_of(run_blocks, model), controller.learning
    rollouts: Batch | None = None
    for repetition in range(learning):
        last = repetition == learning - 1
        streams = lanes.streams if last else [(*entropy, 0, repetition + 1) for entropy in lanes.streams]
        before, rollouts = rollouts, batch(
            controller, gains, motions, worlds, lanes._replace(streams=streams), model, start, columns if last else 0,
            force,
        )  # fmt: skip
        if before is not None:
            _remember(before, rollouts, controller.learned)

        def so_far(share: float, repetition: int = repetition) -> None:
            progress((repetition + share) / learning)

        advance_blocks(rollouts, kernel, threads or cores(), so_far, stop)
        rollouts.setup.law.check()
    assert rollouts is not None
    return outcome_of(rollouts, count, loop, KeptSamples.of(rollouts.state.record, count) if record else None)


def _remember(before: Batch, rollouts: Batch, learned: int) -> None:
    """Give rollouts what their law has learned in the repetition before, and the failures of its wrists."""
    rollouts.state.memory[:, :, 1:learned] = before.state.memory[:, :, 1:learned]
    rollouts.state.sums[:, _ALIVE] = before.state.sums[:, _ALIVE]


def outcome_of(rollouts: Batch, count: int, loop: Loop, kept: KeptSamples | None = None) -> Outcome:
    """Outcome of a batch's rollouts, so far as they have come."""
    totals, planes = totals_of(rollouts, count), len(rollouts.setup.bend)
    failed, until = totals.sums["alive"] <= 0.0, totals.sums["until"]
    steps, error, drift = np.full(count, loop.steps), totals.sums["step_error"], np.zeros(count)
    metrics, places = summary(totals, metrics_in(planes)), len(rollouts.setup.pulls)
    return Outcome(metrics, failed, until, rollouts.course.references, steps, error, drift, kept, places)


def totals_of(rollouts: Batch, count: int) -> Totals:
    """Sums of a batch's rollouts by name, so far as they have come."""
    planes, places = len(rollouts.setup.bend), len(rollouts.setup.pulls)
    sums, goals = to_rows(rollouts.state.sums, count), to_rows(rollouts.world.goals, count)
    of_motion = dict(zip(GOALS, goals[:, 2 * planes :].T, strict=True))
    return Totals(sums_by_name(sums, places), of_motion, rollouts.setup.period)


def advance_blocks(
    rollouts: Batch, kernel: Callable[..., None], workers: int, progress: Callable[[float], None], stop: Event
) -> None:
    """Run all blocks to the end, or until they are to stop, on so many threads."""
    setup, blocks, samples = rollouts.setup, rollouts.blocks, rollouts.samples
    ticks_of_block = samples * setup.ticks * setup.substeps
    together = max(1, min(_SLICE_TICKS // ticks_of_block, blocks // (_SHARES * workers)))
    piece = max(1, _SLICE_TICKS // (setup.ticks * setup.substeps))

    def run(begin: int) -> None:
        end, scratch = min(begin + together, blocks), rollouts.scratch()
        for first in range(0, samples, piece):
            if stop.is_set():
                return
            last = min(first + piece, samples)
            kernel(setup, rollouts.course, rollouts.world, rollouts.state, scratch, Span(begin, end, first, last))

    pieces = range(0, blocks, together)
    if min(workers, len(pieces)) == 1:
        for number, begin in enumerate(pieces, start=1):
            run(begin)
            progress(number / len(pieces))
        return
    with stoppable(workers, stop) as pool:
        for number, _ in enumerate(pool.map(run, pieces), start=1):
            progress(number / len(pieces))


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
