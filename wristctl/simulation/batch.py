"""A batch of rollouts as the kernel wants it: its parts as blocks of lanes."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import sample_period
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.lanes.blocks import lanes_of, spread
from wristctl.seeds import Entropy
from wristctl.simulation.actuator import Winding, at_rest, counted_motor, drive_with, motor_of, winding_of
from wristctl.simulation.disturbances import acting
from wristctl.simulation.frames import frame_counts, readings, remembered, side_by_side
from wristctl.simulation.kernel import Disturbed, LoopCourse, LoopState, LoopValues, Scratch, Setup, Undisturbed
from wristctl.simulation.motion import Motion
from wristctl.simulation.nonideal import inner_of, is_ideal, nonideal_of, unmoved
from wristctl.simulation.observer import NoCamera, Observer, Schedule, Watch
from wristctl.simulation.stationary_filter import Belief, stationary_gains
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import World, bending_limit, check_stops
from wristctl.wrist.dahl import NoInnerFriction
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.segments import segments
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, PulledTendons, RealTendons, Tendons
from wristctl.wrist.tendons import TENDONS_PER_SIDE

Indices = NDArray[np.int64]
# The coordinates (q,) at which a plant begins, at rest.
Start = Callable[[WristParameters], Array]


class Batch(NamedTuple):
    """Arguments of `run_blocks`, with the numbers of blocks and samples."""

    setup: Setup
    course: LoopCourse
    world: LoopValues
    state: LoopState
    blocks: int
    samples: int
    wide: tuple[int, ...]
    """(LANES,), or () for a rollout alone."""

    def scratch(self) -> Scratch:
        """Rows to work on, for one thread."""
        now, target, case = (
            np.zeros((rows, *self.wide)) for rows in (signals_of(self.setup.preview), len(REFERENCE), 2)
        )
        return Scratch(now, target, case)


class Lanes(NamedTuple):
    """Motion, world and stream of each rollout, (count,) each."""

    motion: Indices
    world: Indices
    streams: Sequence[Entropy]


def batch(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    worlds: Sequence[World],
    lanes: Lanes,
    model: PlantModel,
    start: Start | None,
    columns: int,
) -> Batch:
    """The batch of `rollout`, which records so many columns; all worlds have the same structure and timing."""
    filmed, (worlds, body) = worlds, _bodies(worlds)
    world_index = body[lanes.world]
    references = np.empty((len(motions), 3, len(motions[0].time)))
    for target, followed_motion in zip(references, motions, strict=True):
        followed_motion.angles.into(target)
    check_stops(worlds, references[:, 0])
    loop, count = worlds[0].loop, len(gains)
    n, period = loop.plant_segments, loop.control_period
    k, level = model.coordinates(n), loop.actuator.level
    ticks, samples = max(1, round(sample_period(period) / period)), references.shape[2]
    followed, blocks = lanes_of(count), 1 if count == 1 else len(lanes_of(count))
    wide = followed.shape[1:]
    actual = [world.plant for world in worlds]
    coordinates = np.zeros((len(worlds), k)) if start is None else np.array([start(wrist) for wrist in actual])
    actuators = [world.actuator for world in worlds]
    counted = [counted_motor(world.loop.actuator, actuator) for world, actuator in zip(worlds, actuators, strict=True)]
    windings = [_winding(world, actuator) for world, actuator in zip(worlds, actuators, strict=True)]
    step = period / loop.steps
    nonideals = [
        nonideal_of(world.loop.plant, actuator, world.loop.plant.actuator, step)
        for world, actuator in zip(worlds, actuators, strict=True)
    ]
    plants = [world.loop.plant for world in worlds]
    inner = inner_of(
        plants, coordinates, np.zeros(len(worlds)), lambda rows: spread(np.ascontiguousarray(rows[world_index]), count)
    )
    ideal = all(map(is_ideal, nonideals)) and isinstance(inner, NoInnerFriction)

    def of_worlds(row: Callable[[int], Array]) -> Array:
        """A row of each world's as blocks; of one world as one block for all."""
        if len(worlds) == 1:
            return spread(row(0), max(1, *wide, 1))[:1]
        return spread(np.array([row(index) for index in range(len(worlds))])[world_index], count)

    def limits(index: int) -> Array:
        loop, wrist = worlds[index]
        most = wrist.tension_limit if loop.limits else np.inf
        return np.array([wrist.pretension, most, bending_limit(actual[index], loop.plant.end_stop_deg)])

    def at_the_motors(index: int) -> Array:
        return at_rest(
            drive_with(level, counted[index]), actual[index], model, coordinates[index], windings[index].scale
        )

    def resting(index: int) -> Array:
        """State of a world's tendons and springs at rest."""
        counts, lengths = at_the_motors(index)[[0, 2]], model.taut(actual[index], coordinates[index])
        reeled, short = windings[index].scale * counts + windings[index].offset, actual[index].length - lengths
        path = np.append(short, np.abs(coordinates[index]).sum())
        return unmoved(reeled, path, reeled - short, coordinates[index])

    def tendons() -> Tendons:
        stiffness = of_worlds(lambda index: np.array([motor_of(actuators[index]).stiffness]))
        if ideal:
            return ElasticTendons(stiffness) if level == "tendon" else NoTendons()
        nonideal = of_worlds(lambda index: np.array(nonideals[index]))
        state = spread(np.array([resting(index) for index in range(len(worlds))])[world_index], count)
        real = RealTendons(stiffness, nonideal, state, inner)
        return real if level == "tendon" else PulledTendons(nonideal, state, inner)

    ends = zip(motions, references[:, 0, -1], strict=True)
    goals = np.array([followed_motion.goals_at(end) for followed_motion, end in ends])[lanes.motion]
    watch, frames = _watch(filmed, lanes, motions[0].horizon, model, coordinates[body])
    values = LoopValues(
        plant=of_worlds(lambda index: model.values(actual[index], n)),
        model=of_worlds(lambda index: segments(worlds[index].wrist, 1)),
        limits=of_worlds(limits),
        drive=drive_with(level, of_worlds(lambda index: np.array(counted[index]))),
        lead=of_worlds(lambda index: np.array([float(worlds[index].loop.spool_lead)])),
        winding=of_worlds(lambda index: np.array(windings[index])),
        gains=spread(gains.reshape(count, -1), count),
        goals=spread(goals, count),
        schedule=frames,
    )
    kinds = list(dict.fromkeys(world.loop.disturbances for world in worlds))
    cases = [acting(kind, motions[0].time) for kind in kinds]
    case = np.array([kinds.index(world.loop.disturbances) for world in worlds])[world_index]
    state = LoopState(
        which=lanes.motion[followed].reshape(blocks, -1),
        case=case[followed].reshape(blocks, -1),
        memory=spread(np.zeros(max(1, controller.memory)), count),
        coordinates=spread(np.concatenate([coordinates, np.zeros_like(coordinates)], axis=1)[world_index], count),
        motors=spread(np.array([at_the_motors(index) for index in range(len(worlds))])[world_index], count),
        tendons=tendons(),
        sums=spread(np.array([float(name == "alive") for name in SUMS]), count),
        record=np.empty((blocks, samples if columns else 0, columns, *wide)),
        watch=watch,
    )
    course = LoopCourse(references, _disturbances(cases, samples))
    setup = Setup(controller.compiled(count), model, (0,) * k, period, loop.steps, ticks, controller.preview)
    return Batch(setup, course, values, state, blocks, samples, wide)


def _bodies(worlds: Sequence[World]) -> tuple[list[World], Indices]:
    """Group worlds that differ only in their cameras: one representative per group, and each world's group index."""
    bodies, which = dict[tuple[object, ...], tuple[int, World]](), []
    for world in worlds:
        loop = world.loop
        parts = id(world.wrist), id(loop.plant), id(loop.actuator), id(loop.disturbances), loop.limits, loop.spool_lead
        which.append(bodies.setdefault(parts, (len(bodies), world))[0])
    return [world for _, world in bodies.values()], np.array(which)


def _disturbances(cases: Sequence[Array | None], samples: int) -> Disturbed | Undisturbed:
    """Disturbances of all cases, of which one where nothing acts is None."""
    if all(case is None for case in cases):
        return Undisturbed()
    nothing = np.tile((0.0, 1.0), (samples, 1))
    return Disturbed(np.array([(nothing if case is None else case).T for case in cases]))


def _watch(
    worlds: Sequence[World], lanes: Lanes, horizon: float, model: PlantModel, coordinates: Array
) -> tuple[Watch, Schedule] | tuple[NoCamera, NoCamera]:
    """Cameras with their observers by block."""
    loop, count = worlds[0].loop, len(lanes.motion)
    if loop.sensor.level == "ideal":
        return NoCamera(), NoCamera()
    sensors = [world.sensor for world in worlds]
    believed, period = [world.loop.sensor for world in worlds], loop.control_period
    tables, camera = side_by_side(sensors, believed, period, horizon)
    bursts = [worlds[index].loop.plant.sensor.burst for index in lanes.world]
    counts = frame_counts(sensors, horizon)[lanes.world].tolist()
    taken = readings(counts, [sensors[index] for index in lanes.world], lanes.streams, bursts)
    taken[:, :, 0] += np.deg2rad([worlds[index].loop.plant.sensor.zero_deg for index in lanes.world])[:, None]
    order = lanes_of(count)
    blocks, wide = 1 if count == 1 else len(order), order.shape[1:]
    by_block = np.array(
        [np.moveaxis(taken[block], 0, -1) for block in order.reshape(blocks, -1)]
    )  # (blocks, F, 2, lanes)
    cameras = camera[lanes.world][order].reshape(blocks, -1)
    different = cameras if camera.any() else cameras[:1]
    frames = Schedule(*(np.ascontiguousarray(np.moveaxis(table[..., different], -2, 0)) for table in tables))
    gains = stationary_gains([_belief(world) for world in worlds])
    start = np.zeros((len(worlds), 3))
    start[:, 0] = model.angle(coordinates)
    now = spread(start[lanes.world], count)
    observer = Observer(
        gain=spread(gains[lanes.world], count),
        delivered=np.zeros((blocks, remembered(sensors, believed, period), 2, *wide)),
        fused=now, now=now.copy(), at=np.zeros((blocks, 1, *wide)),
    )  # fmt: skip
    pictures = np.zeros((blocks, taken.shape[1], *wide))
    turn, arriving = np.zeros((blocks, 2, cameras.shape[1]), np.int64), np.zeros((blocks, 3, *wide))
    return Watch(by_block.reshape(*by_block.shape[:3], *wide), pictures, turn, arriving, observer), frames


def _belief(world: World) -> Belief:
    return Belief(world.loop.sensor, world.loop.actuator, world.wrist, world.loop.control_period)


def _winding(world: World, actual: Actuator) -> Winding:
    pull = TENDONS_PER_SIDE * world.wrist.pretension
    return winding_of(world.loop.actuator, actual, pull, world.loop.plant.actuator.creep)
