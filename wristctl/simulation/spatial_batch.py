"""Loops in two planes as the kernel wants them: blocks of lanes that share reference, timing and what pushes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.plant import TendonFacts, in_one_plane_only
from wristctl.config.wrist import WristParameters
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.errors import UserError
from wristctl.lanes.blocks import lanes_of, spread, width
from wristctl.seeds import Entropy
from wristctl.simulation.actuator import counted_motor, drive_with, motor_of, winding_of
from wristctl.simulation.bend_course import late_samples
from wristctl.simulation.bend_sums import BEND_SUMS
from wristctl.simulation.frames import frame_counts, readings, remembered, schedule
from wristctl.simulation.observer import NoCamera
from wristctl.simulation.spatial_actuator import FrictionRows, NoFriction
from wristctl.simulation.spatial_kernel import (
    SPATIAL_RECORDED,
    SpatialCourse,
    SpatialScratch,
    SpatialSetup,
    SpatialState,
    SpatialValues,
)
from wristctl.simulation.spatial_observer import Compensated, Ignored, SpatialSchedule, SpatialWatch
from wristctl.simulation.stationary_filter import Belief, stationary_gains
from wristctl.simulation.worlds import World, bending_limit
from wristctl.wrist.directions import in_plane
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON, spatial_values
from wristctl.wrist.spatial.spooled_tendons import OF_A_STATE
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Pull [N] for tensions without a limit: no wrist's wants are as large.
_NO_LIMIT = 1e6


class SpatialBatch(NamedTuple):
    """Arguments of `run_spatial`."""

    setup: SpatialSetup
    course: SpatialCourse
    values: SpatialValues
    state: SpatialState
    preview: int

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self.state.alive)

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.course.references.shape[2])

    @property
    def places(self) -> int:
        """Number of places of tendons."""
        return len(self.setup.pulls)

    def scratch(self) -> SpatialScratch:
        """Rows to work on, for one thread."""
        wide = self.state.alive.shape[2:]
        now, target = np.zeros((signals_of(self.preview), *wide)), np.zeros((len(REFERENCE), *wide))
        return SpatialScratch(now, now.copy(), target, target.copy())


def check_spatial(loop: Loop) -> None:
    """UserError for what a loop has in one plane and not in two."""
    if beyond := in_one_plane_only(loop.plant, loop.plant.actuator):
        key = f"plant.{beyond[0]}"
        raise UserError(f"no loop in two planes has {key}", f"loop.{key}", "leave it at its default")


def as_pairs(wrist: WristParameters, layout: TendonLayout, axis: int) -> WristParameters:
    """The wrist in one plane whose four tendons stiffen it as those of the layout do, on held spools."""
    square = float(layout.multiplicity @ layout.cross_section[:, axis] ** 2) / TENDONS_PER_SIDE
    return wrist.model_copy(update={"tendon_radius": float(np.sqrt(square))})


def spatial_batch(
    law: Controller,
    gains: Array,
    references: Array,
    worlds: Sequence[World],
    layout: TendonLayout,
    acting: Array,
    streams: Sequence[Entropy],
    columns: int,
) -> SpatialBatch:
    """The batch of rollouts of gains (count, g), each in its world and with a stream of its own.

    All worlds have the same structure, timing and camera. Samples are recorded in so many columns.
    """
    worlds, which = different_worlds(worlds)
    loop, count, places = worlds[0].loop, len(gains), len(layout.places)
    check_spatial(loop)
    n, period, alike = loop.plant_segments, loop.control_period, layout.multiplicity.astype(float)
    actual, actuators = [world.plant for world in worlds], [world.actuator for world in worlds]
    facts, wide = [world.loop.plant for world in worlds], lanes_of(count).shape[1:]
    blocks = 1 if count == 1 else len(lanes_of(count))
    samples = references.shape[2]
    ticks = max(1, round(sample_period(period) / period))

    def by_lane(values: Sequence[Array]) -> Array:
        """A row of each world's as blocks."""
        return spread(np.array(values).reshape(len(worlds), -1)[which], count)

    def rows(values: Sequence[Array]) -> Array:
        """A row of each world's as blocks; of one world as one block for all."""
        return by_lane(values) if len(worlds) > 1 else spread(np.ravel(values[0]), width(count))[:1]

    def limits(world: World, wrist: WristParameters) -> Array:
        most = world.wrist.tension_limit if world.loop.limits else _NO_LIMIT
        return np.concatenate([alike * world.wrist.pretension, alike * most, [bending_limit(wrist)]])

    counted = [
        counted_motor(world.loop.actuator, actuator)._replace(stiffness=world.loop.actuator.tendon_stiffness)
        for world, actuator in zip(worlds, actuators, strict=True)
    ]
    windings = [
        winding_of(world.loop.actuator, actuator, TENDONS_PER_SIDE * world.wrist.pretension)
        for world, actuator in zip(worlds, actuators, strict=True)
    ]
    elastic = loop.actuator.level == "tendon"
    drive = drive_with(loop.actuator.level, rows([np.array(motor) for motor in counted]))
    offsets = [
        np.array([winding.scale, *(winding.offset - _slack(fact.actuator, places))])
        for winding, fact in zip(windings, facts, strict=True)
    ]
    rubbing = elastic and any(actuator.friction for actuator in actuators)
    friction = [np.array([actuator.friction, actuator.sheath, 1.0 / actuator.presliding]) for actuator in actuators]
    begin = [np.full(places, motor.stiffness) for motor in counted]
    at_rest = [
        world.wrist.pretension / stiffness if elastic else alike * world.wrist.pretension
        for world, stiffness in zip(worlds, begin, strict=True)
    ]
    motors = [np.append(np.stack([counts, 0.0 * counts], axis=1).ravel(), np.zeros(4)) for counts in at_rest]
    delivered = [
        row[0] * counts + row[1:] if loop.actuator.level != "ideal" else counts
        for row, counts in zip(offsets, at_rest, strict=True)
    ]
    memory = max(1, law.memory)
    values = SpatialValues(
        plant=rows([
            spatial_values(wrist, layout_of(world, wrist, layout), n, axis=np.radians(wrist.stiffness_axis_deg))
            for world, wrist in zip(worlds, actual, strict=True)
        ]),
        believed=rows([
            spatial_values(world.wrist, layout, 1, axis=np.radians(world.wrist.stiffness_axis_deg)) for world in worlds
        ]),
        model_y=rows([segments(in_plane(world.wrist, "ulnar"), 1) for world in worlds]),
        model_z=rows([segments(in_plane(world.wrist, "flexion"), 1) for world in worlds]),
        gains=spread(gains.reshape(count, -1), count),
        limits=rows([limits(world, wrist) for world, wrist in zip(worlds, actual, strict=True)]),
        drive=drive,
        winding=rows(offsets),
        alike=rows([alike] * len(worlds)),
        stiffness=rows([alike * motor_of(actuator).stiffness / TENDONS_PER_SIDE for actuator in actuators]),
        broken_at=rows([_broken_at(fact.actuator, places) for fact in facts]),
        backlash=rows([np.array([fact.actuator.backlash]) for fact in facts]),
        lead=rows([np.array([float(world.loop.spool_lead)]) for world in worlds]),
        friction=FrictionRows(rows(friction)) if rubbing else NoFriction(),
    )  # fmt: skip
    watch, frames = _watch(worlds, which, layout, streams, period, samples * ticks * period)
    state = SpatialState(
        coordinates=spread(np.zeros(4 * n), count),
        memory_y=spread(np.zeros(memory), count),
        memory_z=spread(np.zeros(memory), count),
        alive=spread(np.ones(1), count),
        motors=by_lane(motors),
        delivered=by_lane(delivered),
        tendons=spread(np.zeros(OF_A_STATE * places), count),
        sums=spread(np.zeros(len(BEND_SUMS) + places), count),
        record=np.empty((blocks, samples if columns else 0, columns, *wide)),
        watch=watch,
    )
    setup = SpatialSetup(
        law.compiled(count), (0,) * (2 * n), (0,) * (OF_A_TENDON * places), (0,) * places, (0, 0), period, loop.steps,
        ticks, law.preview, Compensated() if loop.coupling == "compensated" else Ignored(),
    )  # fmt: skip
    course = SpatialCourse(np.ascontiguousarray(references, float), acting, late_samples(samples), frames)
    return SpatialBatch(setup, course, values, state, law.preview)


def different_worlds(worlds: Sequence[World]) -> tuple[list[World], NDArray[np.int64]]:
    """The worlds that are not the same loop and wrist, and which of them each one is."""
    parts = [(id(world.loop), id(world.wrist)) for world in worlds]
    different = dict(zip(parts, worlds, strict=True))
    numbers = {part: number for number, part in enumerate(different)}
    return list(different.values()), np.array([numbers[part] for part in parts])


def spatial_columns(layout: TendonLayout, loop: Loop) -> int:
    """Number of columns of a sample of which all is recorded."""
    return len(SPATIAL_RECORDED) + 3 * len(layout.places) + 2 * loop.plant_segments


def layout_of(world: World, wrist: WristParameters, layout: TendonLayout) -> TendonLayout:
    """The places of the tendons as they are: those of the study on the true circle of tendons."""
    return layout if wrist.tendon_radius == world.wrist.tendon_radius else TendonLayout.of(wrist)


def _slack(facts: TendonFacts, places: int) -> Array:
    slack = np.zeros(places)
    if len(facts.slack) > places:
        what = f"{len(facts.slack)} tendons with slack of {places}"
        raise UserError(what, "loop.plant.actuator.slack", f"at most {places} values")
    slack[: len(facts.slack)] = facts.slack
    return slack


def _broken_at(facts: TendonFacts, places: int) -> Array:
    times = np.full(places, np.inf)
    if facts.broken_at is not None:
        if facts.broken_tendon > places:
            what = f"tendon {facts.broken_tendon} of {places} cannot break"
            raise UserError(what, "loop.plant.actuator.broken_tendon", f"1 to {places}")
        times[facts.broken_tendon - 1] = facts.broken_at
    return times


def _watch(
    worlds: Sequence[World],
    which: NDArray[np.int64],
    layout: TendonLayout,
    streams: Sequence[Entropy],
    period: float,
    horizon: float,
) -> tuple[SpatialWatch, SpatialSchedule] | tuple[NoCamera, NoCamera]:
    """One camera for all lanes, with an observer for each; `which` (count,) of the worlds each has."""
    if worlds[0].loop.sensor.level == "ideal":
        return NoCamera(), NoCamera()
    count, places = len(which), len(layout.places)
    sensors, believed = [world.sensor for world in worlds], [world.loop.sensor for world in worlds]
    first = schedule(sensors[0], period, horizon, believed[0])
    bursts = [worlds[world].loop.plant.sensor.burst for world in which]
    counts, cameras = frame_counts(sensors, horizon)[which].tolist(), [sensors[world] for world in which]
    ulnar = readings(counts, cameras, streams, bursts)
    flexion = readings(counts, cameras, [(*stream, 1) for stream in streams], bursts)
    zero = np.radians([world.loop.plant.sensor.zero_deg for world in worlds])[which, None]
    taken = np.stack([ulnar[:, :, 0] + zero, flexion[:, :, 0], ulnar[:, :, 1]], axis=2)
    order = lanes_of(count)
    blocks, wide = 1 if count == 1 else len(order), order.shape[1:]
    by_block = np.array([np.moveaxis(taken[lanes], 0, -1) for lanes in order.reshape(blocks, -1)])
    beliefs = [
        [
            Belief(world.loop.sensor, world.loop.actuator, as_pairs(wrist, layout, axis), period)
            for axis, wrist in enumerate(in_plane(world.wrist, plane) for plane in ("ulnar", "flexion"))
        ]
        for world in worlds
    ]
    gains = np.concatenate([stationary_gains([pair[axis] for pair in beliefs]) for axis in range(2)], axis=1)
    still = spread(np.zeros(6), count)
    watch = SpatialWatch(
        readings=np.ascontiguousarray(by_block.reshape(blocks, taken.shape[1], 3, *wide)),
        pictures=np.zeros((blocks, taken.shape[1], 2, *wide)),
        turn=np.zeros((blocks, 3), np.int64),
        gain=spread(gains[which], count),
        delivered=np.zeros((blocks, remembered(sensors[:1], believed[:1], period), places, *wide)),
        fused=still,
        now=still.copy(),
    )
    ticks = SpatialSchedule(first.captures, np.atleast_1d(first.late), np.atleast_1d(first.believed))
    return watch, ticks
